"""The rules for names, where ROS 2 has them."""

from rclpy.names import validate_topic_name

__all__ = ["TOPIC_SEPARATOR_STRING", "validate_topic_name"]

TOPIC_SEPARATOR_STRING = "/"
