"""The schedule of a walk, and the reference of its ZMP.

The reference is in the middle of the standing sole, and between the soles at rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES
from humanoid_motion.robot_model import RobotModel

from walking.footsteps.footstep import OUTWARD, Footstep, Pose, Stance, other, stances
from walking.pattern.settings import WalkSettings

_AT_FIRST = 0.3  # share of the way inwards that the ZMP has gone when single support begins
# When in a stop the reference reaches the capture point, leaves it, and arrives where the CoM comes
# to rest, as shares of the end.
_STOP = (1 / 12, 1 / 3, 2 / 3)


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

    def begin_of(self, step: int) -> float:
        """Return the time at which the double support before a footstep begins [s]."""
        return self._first(step).first * self.period

    def touchdown_of(self, step: int) -> float:
        """Return the time at which the foot of a footstep touches the floor [s]."""
        return self._first(step + 1).first * self.period

    def _first(self, step: int) -> Phase:
        return next(phase for phase in self.phases
                    if phase.step == step and phase.kind in ("double", "end"))


def schedule(
    stance: Stance, footsteps: Sequence[Footstep], settings: WalkSettings, *, at_rest: bool
) -> Schedule:
    """Lay out the phases of a walk.

    Durations are rounded to whole periods; each phase has at least one.

    Args:
        stance: The soles at the beginning.
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


def sole_middle(robot: RobotModel, side: str, pose: Pose) -> Array:
    """Compute x and y of the middle of a sole's support area in odom, (2,) [m]."""
    x_min, x_max, y_min, y_max = robot.feet[side].rectangle
    return np.array(pose.moved(0.5 * (x_min + x_max), 0.5 * (y_min + y_max))[:2])


def rest_point(robot: RobotModel, stance: Stance) -> Array:
    """Compute the place of the CoM at rest in odom, (2,) [m].

    It lies between the soles' frames as in half-sitting, so that a robot with its feet beside each
    other ends in half-sitting.
    """
    q = robot.configuration(np.zeros(3), robot.config.half_sitting)
    soles = [robot.frame_position(q, robot.feet[side].frame) for side in SIDES]
    offset = robot.com(q) - np.mean(soles, axis=0)
    return np.array(stance.middle.moved(float(offset[0]), float(offset[1]))[:2])


def zmp_reference(
    robot: RobotModel, plan: Schedule, zmp: Array, capture: Array | None = None,
    inward: float = 0.0, first_inward: float = 0.0,
) -> Array:
    """Compute the reference of the ZMP at every sample.

    It stays where it is before the first step, rests in the middle of the standing sole in single
    support, and moves evenly between these places in double support. In a walk without footsteps,
    which comes to rest from a motion, it first goes to the capture point, so that the CoM is
    stopped without pushing the ZMP far beyond it.

    Args:
        zmp: Reference of the ZMP at the beginning, (2,) [m].
        capture: Capture point at the beginning, (2,) [m] (Pratt et al., 2006); None for a robot at
            rest.
        inward: Distance from the middle of the standing sole, towards the other one [m].
        first_inward: That in the first step, if it is larger [m].

    Returns:
        x and y of the ZMP in odom, (N, 2) [m].
    """
    samples, places = [0], [zmp]

    def hold_until(sample: int) -> None:
        samples.append(sample)
        places.append(places[-1])

    def on_sole(phase: Phase, share: float) -> Array:
        side, shift = other(phase.swing), share * inward
        if phase.step == 0:
            shift = share * max(inward, first_inward)
        return sole_middle(
            robot, side, phase.stance.foot(side).moved(0.0, -OUTWARD[side] * shift))

    for phase in plan.phases:
        if phase.kind == "start":
            hold_until(phase.last)
        elif phase.kind == "double":
            samples.append(phase.last)
            places.append(on_sole(phase, _AT_FIRST))
        elif phase.kind == "single":
            middle = on_sole(phase, 1.0)
            if (middle != places[-1]).any():
                samples.append((phase.first + phase.last) // 2)
                places.append(middle)
            hold_until(phase.last)
        else:
            count = phase.last - phase.first
            rest = rest_point(robot, phase.stance)
            if capture is not None and phase.first == 0:
                samples += [round(share * count) for share in _STOP]
                places += [capture, capture, rest]
            else:
                samples.append(phase.first + max(1, count // 6))
                places.append(rest)
            hold_until(phase.last)
    rows = np.array(places)
    grid = np.arange(plan.phases[-1].last + 1)
    return np.column_stack([np.interp(grid, samples, column) for column in rows.T])
