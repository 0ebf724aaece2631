"""A ROS interface package: its modules `msg`, `srv` and `action` are made from the definitions."""

from ros2_embedded.message_modules import provide

provide(__name__)
