"""What each foot is to bear, and which feet have landed while the robot walks.

A robot that was pushed, or a floor that is not level, brings a foot to the floor earlier or later
than the reference. A foot that has landed early bears load, and is not to be pressed on by what is
left of its way down. A foot that is late is to be lowered further.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from numpy.typing import NDArray

from hrp2_sim_bridge.settings import TICK

_MEMORY = 0.1  # time after the last contact for which a foot still counts as bearing [s]
_WALKING = 0.3  # time after the reference had a foot in the air for which the forces count [s]


@dataclass(frozen=True)
class FootLoads:
    """Wanted loads of the feet; rows are the left and the right foot.

    Attributes:
        force: Normal forces, (2,) [N].
        moment: Moments about the x and y axes of each sole through its middle, (2, 2) [N m].
        pivot: x and y of the point between the soles about which the body tilts, in the level
            frame, (2,) [m].
        beyond: Distance of the wanted ZMP from the one that the soles bear [m].
    """

    force: Array
    moment: Array
    pivot: Array
    beyond: float


def share_load(
    zmp: Array, normal_force: float, centers: Array, turns: Array, standing: Sequence[bool],
    reach: Array, inset: float,
) -> FootLoads:
    """Distribute a ZMP between the feet: forces by its position, ankle moments for the rest.

    Both ankles are asked for the same distance between the force and the middle of the sole, each
    up to the edge of its own, turned sole.

    Args:
        zmp: x and y of the wanted ZMP in the level frame, (2,) [m].
        normal_force: Normal force on both soles together [N].
        centers: x and y of the middles of the left and the right sole, (2, 2) [m].
        turns: Rotation matrices (2, 2, 2) of the soles about the vertical.
        standing: Whether each sole is on the floor; at least one must be.
        reach: Largest distance of the ZMP from a sole's middle along the sole's x and y, (2,) [m].
        inset: Distance of the ZMP from a sole's middle at which this sole alone bears it [m].
    """
    (left_x, left_y), (right_x, right_y) = centers.tolist()
    x, y = zmp.tolist()
    if all(standing):
        line_x, line_y = left_x - right_x, left_y - right_y
        length = math.hypot(line_x, line_y)
        along = ((x - right_x) * line_x + (y - right_y) * line_y) / length
        left = min(max((along - inset) / (length - 2.0 * inset), 0.0), 1.0)
    else:
        left = 1.0 if standing[0] else 0.0
    share = left, 1.0 - left
    pivot = left * left_x + share[1] * right_x, left * left_y + share[1] * right_y
    most_x, most_y = reach.tolist()
    moment, missing_x, missing_y = [], 0.0, 0.0
    # Plain floats are faster than arrays of two numbers.
    for part, ((xx, xy), (yx, yy)) in zip(share, turns.tolist(), strict=True):
        # The arm of the force in the axes of this sole.
        arm_x = (x - pivot[0]) * xx + (y - pivot[1]) * yx
        arm_y = (x - pivot[0]) * xy + (y - pivot[1]) * yy
        reached_x = min(max(arm_x, -most_x), most_x)
        reached_y = min(max(arm_y, -most_y), most_y)
        moment.append((part * normal_force * reached_y, -part * normal_force * reached_x))
        off_x, off_y = part * (arm_x - reached_x), part * (arm_y - reached_y)
        missing_x += xx * off_x + xy * off_y
        missing_y += yx * off_x + yy * off_y
    return FootLoads(
        np.array(share) * normal_force, np.array(moment), np.array(pivot),
        max(abs(missing_x), abs(missing_y)))


@dataclass(frozen=True)
class Landing:
    """The feet in one tick; entries are the left and the right foot.

    Attributes:
        walking: Whether the reference has or recently had a foot in the air.
        early: Whether each foot bears load although the reference still lowers it.
        descent: Way down of the reference in this tick of feet that have landed early, (2,) [m].
        late: Whether each foot is asked to bear load but has not landed.
    """

    walking: bool
    early: tuple[bool, bool]
    descent: Array
    late: tuple[bool, bool]

    def standing(self, planned: Sequence[bool]) -> tuple[bool, bool]:
        """Return whether each foot is on the floor, by the reference or because it landed early."""
        return bool(planned[0] or self.early[0]), bool(planned[1] or self.early[1])


class Touchdown:
    """Compares the reference with the forces; where the robot does not walk, they do not count.

    Args:
        bears: Normal force above which a foot bears load [N].
    """

    def __init__(self, bears: float) -> None:
        self._bears = bears
        self.reset()

    def reset(self) -> None:
        """Forget all contacts and steps."""
        self._since_contact = np.full(2, np.inf)
        self._since_step = np.inf
        self._free = np.zeros(2, dtype=bool)
        self._height = np.zeros(2)

    def update(
        self, normal: Array, asked: Array, heights: Array, standing: Sequence[bool]
    ) -> Landing:
        """Judge the feet at the end of a tick.

        The arguments are their measured and their wanted normal forces, (2,) [N], and in the
        reference the heights of the soles over the floor, (2,) [m], and whether each is on it.
        """
        descent, self._height = self._height - heights, heights
        planned = np.array(standing)
        self._since_contact = np.where(normal > self._bears, 0.0, self._since_contact + TICK)
        self._since_step = 0.0 if not planned.all() else self._since_step + TICK
        bearing = self._since_contact <= _MEMORY
        # A foot is free from when it has left the floor until it has landed.
        self._free = np.where(planned, self._free & ~bearing, self._free | ~bearing)
        walking = self._since_step <= _WALKING
        early = walking & ~planned & self._free & bearing & (descent > 0.0)
        late = walking & planned & self._free & (asked > 2.0 * self._bears)
        return Landing(walking, _pair(early), np.where(early, descent, 0.0), _pair(late))


def _pair(values: NDArray[np.bool_]) -> tuple[bool, bool]:
    return bool(values[0]), bool(values[1])
