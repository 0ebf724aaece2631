"""The former name of `rclpy.event_handler`."""

from __future__ import annotations

import warnings

from rclpy.event_handler import *  # noqa: F403

warnings.warn("rclpy.qos_event is deprecated, use rclpy.event_handler", stacklevel=2)
