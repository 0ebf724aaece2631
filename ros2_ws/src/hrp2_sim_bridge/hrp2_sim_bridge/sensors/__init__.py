"""The robot's sensors and the door's encoder, computed from the simulated state."""
