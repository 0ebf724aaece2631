"""The nodes that move the robot."""
