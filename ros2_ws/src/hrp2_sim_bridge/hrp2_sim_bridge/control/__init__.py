"""The reference of the joints, their servos, and the stabilizer that keeps the robot upright."""
