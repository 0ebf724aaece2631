"""Clients of services."""

from rclpy.service import Client

__all__ = ["Client"]
