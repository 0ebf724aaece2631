"""Where a robot is in ``odom``, and which sole it stands on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from door_impact_common.arrays import Array

OTHER = {"left": "right", "right": "left"}


@dataclass(frozen=True)
class RobotPose:
    """Poses of base_link and of the soles in ``odom``.

    Attributes:
        base: Pose of base_link, (4, 4).
        soles: Poses of the ``left`` and ``right`` sole, (4, 4) each. Without an IMU a sole that
            bears load lies flat in z = 0.
        support: Side of the sole that bears most of the load.
    """

    base: Array
    soles: Mapping[str, Array]
    support: str


def next_support(
    support: str, loads: Mapping[str, float], loaded_force: float, take_over: float
) -> str:
    """Return the side of the sole that supports the robot from now on.

    Args:
        support: Side of the sole that supports it until now.
        loads: Normal force on each sole, not negative [N].
        loaded_force: Normal force that the other sole must at least bear [N].
        take_over: Share of the load that the other sole must at least bear.
    """
    other = OTHER[support]
    taken = loads[other] > max(loaded_force, take_over * sum(loads.values()))
    return other if taken else support
