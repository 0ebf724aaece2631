"""The driver that takes trajectories, and the stabilizer that keeps the robot up."""
