"""The rules for names, where ROS 2 has them."""

from rclpy.names import validate_node_name

__all__ = ["validate_node_name"]
