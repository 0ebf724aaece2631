"""States that a physics engine reports."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from door_impact_common.arrays import Array

# Columns of the link states of an engine; the left and the right sole come first.
CONTACT_LINK, IMU = 2, 3

# Forces [N] and torques [N m] of the ankles on the soles, left and right, in their frames, (2, 6).
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
