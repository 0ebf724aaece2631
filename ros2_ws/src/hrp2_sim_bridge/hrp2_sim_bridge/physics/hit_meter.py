"""Contact of robot and leaf, and what the brace carries while they touch."""

from __future__ import annotations

from dataclasses import dataclass
from operator import itemgetter
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import RobotConfig

from hrp2_sim_bridge.physics.door_body import DoorBody
from hrp2_sim_bridge.physics.robot_body import RobotBody
from hrp2_sim_bridge.settings import SAMPLE

CONTACT_FORCE = 5.0  # above it robot and door touch [N]
_NORMAL_FORCE = 9  # in PyBullet's contact points


@dataclass(frozen=True)
class Touch:
    """Contact of robot and leaf.

    Attributes:
        force: sum of the normal forces [N].
        link: index of the link that presses most, -1 for none.
        point: (3,) where it does, in the world [m].
    """

    force: float
    link: int
    point: Array


NO_TOUCH = Touch(0.0, -1, np.zeros(3))


class HitMeter:
    """Measures the contact each millisecond and sums the braced joints' impulses over the run.

    Args:
        client: of PyBullet.
        robot: to touch the door with.
        door: to touch.
        config: which joints are braced, what their motors give.
    """

    def __init__(
        self, client: Any, robot: RobotBody, door: DoorBody, config: RobotConfig
    ) -> None:
        self._client = client
        self._robot = robot
        self._door = door
        self._indices = robot.servos.braced_indices
        self._limit = config.effort_limit[self._indices]
        self.clear()

    def clear(self) -> None:
        """Begin anew."""
        #: Angular impulses (B,) of the braced joints while touching [N m s]: what they carried,
        self.carried_impulse = np.zeros(len(self._indices))
        #: what of it was beyond their motors' limits, the brace's own share,
        self.brace_impulse = np.zeros(len(self._indices))
        #: and the most that the motors could have given in that time.
        self.motor_impulse = np.zeros(len(self._indices))
        self._force, self._latest = 0.0, NO_TOUCH

    def add_step(self, share: float) -> None:
        """Measure the contact after a physics step, so great a share of the millisecond."""
        touch = self._touch()
        if touch.force > 0.0:
            self._force += share * touch.force
            self._latest = touch

    def take(self, torque: Array, *, braced: bool) -> Touch:
        """End a millisecond.

        Args:
            torque: (30,) of the motors then [N m].
            braced: whether the brace holds.

        Returns:
            Its mean force, and where robot and door touched last.
        """
        if self._latest is NO_TOUCH:
            return NO_TOUCH
        touch = Touch(self._force, self._latest.link, self._latest.point)
        self._force, self._latest = 0.0, NO_TOUCH
        if braced and touch.force > CONTACT_FORCE:
            load = np.abs(torque[self._indices])
            self.carried_impulse += load * SAMPLE
            self.brace_impulse += np.maximum(load - self._limit, 0.0) * SAMPLE
            self.motor_impulse += self._limit * SAMPLE
        return touch

    def _touch(self) -> Touch:
        contacts = self._client.getContactPoints(self._robot.body, self._door.body)
        if not contacts:
            return NO_TOUCH
        most = max(contacts, key=itemgetter(_NORMAL_FORCE))
        total = sum(contact[_NORMAL_FORCE] for contact in contacts)
        return Touch(total, most[3], np.array(most[6])) if total > 0.0 else NO_TOUCH
