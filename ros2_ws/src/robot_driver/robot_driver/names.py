"""Names of the topics by which every driver moves the robot and says what it measures.

They are relative, but for the clock's: a node's namespace and remappings move them.
"""

from __future__ import annotations

CLOCK = "/clock"
JOINTS = "joint_states"
IMU = "imu"
DOOR = "door_angle"
WRENCHES = {side: f"{side}_foot/wrench" for side in ("left", "right")}
HAND = "right_wrist/wrench"
TRAJECTORY = "joint_trajectory"
HANDLED = "sim/handled"  # to a simulation alone
PAUSED = "sim/paused"  # from one

COMMANDERS = ("motion_server",)
"""Nodes that send trajectories."""
