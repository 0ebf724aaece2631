"""Whether the robot has fallen."""

from __future__ import annotations

import math

from hrp2_sim_bridge.robot_world import RobotBody
from hrp2_sim_bridge.spline import Array

_FALLEN_TILT = math.radians(30.0)


class FallWatch:
    """Watches the base's tilt and what lies on the floor.

    Attributes:
        reason: what happened first; empty while the robot stands.
        max_tilt: largest angle between the base's z axis and the vertical [rad].
    """

    def __init__(self) -> None:
        self.reason = ""
        self.max_tilt = 0.0

    def update(self, robot: RobotBody, floor: int, quaternion: Array) -> None:
        """Look at the robot, its base's quaternion (4,) x, y, z, w."""
        x, y = float(quaternion[0]), float(quaternion[1])
        tilt = math.acos(max(-1.0, 1.0 - 2.0 * (x * x + y * y)))
        self.max_tilt = max(self.max_tilt, tilt)
        if self.reason:
            return
        if tilt > _FALLEN_TILT:
            self.reason = f"base tilted by {math.degrees(tilt):.0f} deg"
        touchers = robot.floor_touchers(floor)
        if touchers:
            self.reason = f"on the floor: {', '.join(sorted(touchers))}"
