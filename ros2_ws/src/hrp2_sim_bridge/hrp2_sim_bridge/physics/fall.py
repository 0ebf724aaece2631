"""Whether the robot has fallen."""

from __future__ import annotations

import math

from hrp2_sim_bridge.physics.robot_body import RobotBody

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

    def update(self, robot: RobotBody, floor: int) -> bool:
        """Look at the robot; True when it has just fallen."""
        tilt = robot.tilt()
        self.max_tilt = max(self.max_tilt, tilt)
        if self.reason:
            return False
        if tilt > _FALLEN_TILT:
            self.reason = f"base tilted by {math.degrees(tilt):.0f} deg"
        if touchers := robot.floor_touchers(floor):
            self.reason = f"on the floor: {', '.join(sorted(touchers))}"
        return bool(self.reason)
