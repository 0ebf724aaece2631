"""States that a physics engine reports."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from door_impact_common.arrays import Array

# Columns of the link states of an engine; the left and the right sole come first.
CONTACT_LINK, IMU = 2, 3

# Forces [N] and torques [N m] on the bodies beyond force sensors, in their frames, (B, 6): left and
# right sole; left and right hand, if the wrists have sensors.
Reactions = Sequence[Sequence[float]]


@dataclass(frozen=True)
class BodyState:
    """Pose and velocity of one or more frames in the world.

    Attributes:
        position: Positions of the frames' origins, (..., 3) [m].
        quaternion: Orientations x, y, z, w, (..., 4).
        linear: Velocities of the frames' origins, (..., 3) [m/s].
        angular: Angular velocities, (..., 3) [rad/s].
    """

    position: Array
    quaternion: Array
    linear: Array
    angular: Array

    def at(self, index: Any) -> BodyState:
        """Return the states at an index of the leading axes."""
        return BodyState(
            self.position[index], self.quaternion[index], self.linear[index], self.angular[index]
        )

    def beside(self, other: BodyState) -> BodyState:
        """Return these states (T, A) and others (T, B) as states (T, A + B)."""
        return BodyState(*(
            np.concatenate(pair, axis=1) for pair in zip(
                (self.position, self.quaternion, self.linear, self.angular),
                (other.position, other.quaternion, other.linear, other.angular), strict=True)))


def in_turn(states: Sequence[BodyState]) -> BodyState:
    """Return T states (B,) as states (T, B)."""
    return BodyState(*(np.array([getattr(state, name) for state in states])
                       for name in ("position", "quaternion", "linear", "angular")))


class DoorState(NamedTuple):
    """Angle [rad] and angular velocity [rad/s] of the leaf, positive when it opens."""

    angle: float
    velocity: float


class Touch(NamedTuple):
    """Contact between robot and leaf.

    Attributes:
        force: Sum of the normal forces [N].
        link: Index of the link with the largest force, -1 without contact.
        point: Point in the world at which that link touches the leaf, (3,) [m].
    """

    force: float
    link: int
    point: Sequence[float]


NO_TOUCH = Touch(0.0, -1, (0.0, 0.0, 0.0))


class FloorContact(NamedTuple):
    """Contact between a link of the robot and the floor.

    Attributes:
        link: Name of the link.
        point: Point of the contact in the world, (3,) [m].
        force: Normal force of the floor in the world, (3,) [N].
        distance: Distance of the link from the floor [m]; positive where they do not touch yet.
    """

    link: str
    point: Sequence[float]
    force: Sequence[float]
    distance: float
