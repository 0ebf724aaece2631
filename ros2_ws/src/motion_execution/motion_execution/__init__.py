"""Hits, walks and passages through a door: what is sent to the robot's driver, and when."""
