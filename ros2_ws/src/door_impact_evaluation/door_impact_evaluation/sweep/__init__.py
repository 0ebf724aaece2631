"""Sweeps: many runs of perturbed doors and robots."""
