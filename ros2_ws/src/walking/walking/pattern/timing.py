"""The schedule of a walk: when which foot swings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array

from walking.footsteps.footstep import Footstep, Stance, stances
from walking.pattern.settings import WalkSettings


@dataclass(frozen=True)
class Phase:
    """A part of the walk in which the same soles bear load.

    Attributes:
        kind: ``"start"``, ``"double"`` (support), ``"single"`` (support) or ``"end"``.
        first: Index of its first sample.
        last: Index of its last sample, which is the first one of the next phase.
        stance: The soles; in single support the swing foot's is the one before the step.
        step: Index of the footstep; in the start it is 0 and in the end the number of footsteps.
        swing: Foot that swings in single support, or will swing after it; empty in the end.
    """

    kind: str
    first: int
    last: int
    stance: Stance
    step: int
    swing: str

    @property
    def sides(self) -> tuple[str, ...]:
        """Feet that bear load."""
        return tuple(side for side in ("left", "right")
                     if self.kind != "single" or side != self.swing)


@dataclass(frozen=True)
class Schedule:
    """Phases of a walk on an even grid of samples.

    Attributes:
        phases: The phases in the order of time.
        period: Time between two samples [s].
    """

    phases: tuple[Phase, ...]
    period: float

    @property
    def time(self) -> Array:
        """Times of all samples since the beginning, (N,) [s]."""
        return np.asarray(self.period * np.arange(self.phases[-1].last + 1))


def schedule(
    stance: Stance, footsteps: Sequence[Footstep], settings: WalkSettings, *, at_rest: bool
) -> Schedule:
    """Lay out the phases of a walk.

    Durations are rounded to whole periods; each phase has at least one.

    Args:
        stance: The soles at the beginning.
        footsteps: The footsteps.
        settings: Settings.
        at_rest: Whether the robot stands still at the beginning, so that a start comes first.
    """
    phases: list[Phase] = []

    def add(kind: str, duration: float, step: int) -> None:
        first = phases[-1].last if phases else 0
        count = max(1, round(duration / settings.period))
        swing = footsteps[step].side if step < len(footsteps) else ""
        phases.append(Phase(kind, first, first + count, feet[step], step, swing))

    feet = stances(stance, footsteps)
    if at_rest:
        add("start", settings.start, 0)
    for index, step in enumerate(footsteps):
        add("double", settings.double_support, index)
        add("single", step.duration - settings.double_support, index)
    add("end", settings.end, len(footsteps))
    return Schedule(tuple(phases), settings.period)
