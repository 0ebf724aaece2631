"""Decoding: raw counts become checked counts, angles and angular velocities, without ROS."""
