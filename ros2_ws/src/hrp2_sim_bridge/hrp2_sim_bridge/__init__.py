"""A simulated robot in front of a door, in place of the robot's driver; the ZMP from its feet."""
