"""Studies of the simulated physics, from which docs/physics.md is made."""
