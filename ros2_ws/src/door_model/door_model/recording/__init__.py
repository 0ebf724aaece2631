"""Recordings of a door's encoder: reading, checking, cutting into swings, and simulating them."""
