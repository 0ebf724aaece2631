"""Sweeps: many simulated hits and walks that differ from what the robot knows."""
