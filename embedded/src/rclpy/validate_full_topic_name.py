"""The rules for names, where ROS 2 has them."""

from rclpy.names import validate_full_topic_name

__all__ = ["validate_full_topic_name"]
