"""Runs of the whole system and their evaluation: demonstration, benchmarks, sweeps, studies."""
