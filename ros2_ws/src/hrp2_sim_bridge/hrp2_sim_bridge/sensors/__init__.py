"""What the robot's sensors would report of the simulated state."""
