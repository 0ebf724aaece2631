"""Footsteps and whole-body walking motions, without ROS."""
