"""Recordings of a door's encoder: read, unwrapped, checked, cut into swings, or simulated."""
