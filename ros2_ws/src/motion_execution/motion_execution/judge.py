"""Judges whether a robot has fallen or leaves its trajectory, in sentences for users."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from door_impact_common.arrays import Array


def fell(tilt: float, limit: float) -> str:
    """Reason for a tilt of the trunk that exceeds its limit, both in [rad]; else empty."""
    if not tilt > limit:
        return ""
    return (f"the robot fell: its trunk is tilted by {math.degrees(tilt):.1f} deg, at most "
            f"{math.degrees(limit):.1f} deg are allowed; stand it up again (in the simulation: "
            "sim/reset)")


def farthest(position: Array, wanted: Array, names: Sequence[str] = ()) -> tuple[str, float]:
    """Return the name of the joint that is farthest from its wanted position, and how far [rad].

    Args:
        position: Joint positions, (J,) [rad].
        wanted: Wanted joint positions, (J,) [rad].
        names: Names of the joints; may be empty.
    """
    off = np.abs(position - wanted)
    worst = int(np.argmax(off))
    return names[worst] if len(names) else f"joint {worst}", float(off[worst])


def off_track(
    position: Array, wanted: Array, names: Sequence[str], limit: float, where: str
) -> str:
    """Reason for a robot that does not follow its trajectory; empty where it does.

    Args:
        position: Joint positions, (J,) [rad].
        wanted: Joint positions of the trajectory, (J,) [rad].
        names: Names of the joints; may be empty.
        limit: Largest allowed distance of a joint from the trajectory [rad].
        where: Clause that describes the wanted positions, such as "the hold ends".
    """
    name, off = farthest(position, wanted, names)
    if off <= limit:
        return ""
    return (f"{name} is {off:.3f} rad from where {where}, at most {limit:g} rad are allowed: the "
            "driver refused the trajectory or cannot follow it")
