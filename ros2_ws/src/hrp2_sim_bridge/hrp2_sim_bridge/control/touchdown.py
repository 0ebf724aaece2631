"""Which feet have landed while the robot walks: the reference's word, corrected by the forces.

A robot that was pushed, or a floor that is not level, brings a foot to the floor earlier or later
than the reference. A foot that has landed early bears load, and is not to be pressed on by what is
left of its way down. A foot that is late is to be lowered further.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from numpy.typing import NDArray

from hrp2_sim_bridge.settings import TICK

_MEMORY = 0.1  # time after the last contact for which a foot still counts as bearing [s]
_WALKING = 0.3  # time after the reference had a foot in the air for which the forces count [s]


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

        Args:
            normal: Measured normal forces, (2,) [N].
            asked: Normal forces that the feet were asked for, (2,) [N].
            heights: Heights of the soles over the floor in the reference, (2,) [m].
            standing: Whether each foot is on the floor in the reference.
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
