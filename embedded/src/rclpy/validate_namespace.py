"""The rules for names, where ROS 2 has them."""

from rclpy.names import validate_namespace

__all__ = ["validate_namespace"]
