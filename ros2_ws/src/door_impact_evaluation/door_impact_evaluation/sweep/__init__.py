"""Sweeps: many simulated hits with perturbed doors and robots."""
