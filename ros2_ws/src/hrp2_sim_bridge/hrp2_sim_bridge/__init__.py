"""A PyBullet HRP-2 in front of a door, in place of the robot's driver; the ZMP from its feet."""
