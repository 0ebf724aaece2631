"""A PyBullet HRP-2 in front of a door, standing in for the robot's driver; the ZMP from the foot sensors."""
