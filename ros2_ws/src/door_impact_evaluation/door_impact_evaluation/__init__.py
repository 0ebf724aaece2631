"""Runs of the whole system and what is measured in them: demonstration, benchmarks, sweeps."""
