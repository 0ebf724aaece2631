"""Studies of the simulated physics, the source of docs/physics.md."""
