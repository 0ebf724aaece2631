"""Detection of a fall of the robot."""

from __future__ import annotations

import math
from collections.abc import Collection

from hrp2_sim_bridge.physics.engine import Engine

_FALLEN_TILT = math.radians(30.0)  # tilt of the base beyond which the robot has fallen [rad]


class FallWatch:
    """Watches the base's tilt and the links that touch the floor.

    Args:
        soles: Names of the links that may touch the floor.

    Attributes:
        reason: What indicated the fall first; empty while the robot stands.
        max_tilt: Largest angle between the base's z axis and the vertical since the start [rad].
    """

    def __init__(self, soles: Collection[str]) -> None:
        self._soles = soles
        self.reason = ""
        self.max_tilt = 0.0

    def update(self, engine: Engine) -> bool:
        """Examine the robot after a tick; return True in the tick in which it has fallen."""
        tilt = engine.tilt()
        self.max_tilt = max(self.max_tilt, tilt)
        if self.reason:
            return False
        if tilt > _FALLEN_TILT:
            self.reason = f"base tilted by {math.degrees(tilt):.0f} deg"
        touching = {
            contact.link for contact in engine.floor_contacts()
            if contact.link not in self._soles and contact.distance <= 0.0
        }
        if touching:
            self.reason = f"on the floor: {', '.join(sorted(touching))}"
        return bool(self.reason)
