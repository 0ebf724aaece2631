"""Collision shapes of the robot's links, and the search for the nearest pair of them."""
