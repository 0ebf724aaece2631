"""Finds the phases of the hits in a recording, and the moments of contact and of the peak.

The executor's goals are no topics that a recorder keeps. But every plan is recorded, and so are
the trajectories that the executor sends: a phase begins where a trajectory has the first knot of
the phase. Contact and peak are those of the door's angle.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from door_impact_evaluation.report.recorded_run import Series

_SAME = 1e-6      # largest difference of the joint angles of a knot and its copy [rad]
_MOVED = 0.005    # angle by which a door that is hit has moved [rad]
_LONGEST = 10.0   # time after the start of the run-up in which a contact is looked for [s]
_RUN_UP = "cam"


@dataclass(frozen=True)
class Hit:
    """An executed plan.

    Attributes:
        plan: Message ImpactPlan.
        starts: Start [s] and name of each phase that was begun, in order.
        end: Time at which the motion had ended [s].
        contact: Time of the contact [s]; None without one.
        peak: Time of the door's largest angle after it [s]; None without one.
    """

    plan: Any
    starts: list[tuple[float, str]]
    end: float
    contact: float | None
    peak: float | None


def find_hits(plans: Sequence[tuple[float, Any]], trajectories: Sequence[tuple[float, Any]],
              door: Series | None) -> list[Hit]:
    """Find the plans that were executed, in the order of their starts.

    Args:
        plans: Messages ImpactPlan, with the times at which they were recorded [s].
        trajectories: Messages JointTrajectory, with their starts [s].
        door: Angle of the door (n, 1) [rad].
    """
    sent = sorted(trajectories, key=lambda row: row[0])
    begun = []
    for number, (start, trajectory) in enumerate(sent):
        known = [plan for received, plan in plans if received <= start]
        starts = _phase_starts(known[-1], start, trajectory) if known else []
        if starts:
            begun.append((number, known[-1], starts))
    following = [number for number, _, _ in begun[1:]] + [len(sent)]
    hits = []
    for (_, plan, starts), last in zip(begun, following, strict=False):
        start, trajectory = sent[last - 1]
        rest = trajectory.points[-1].time_from_start if trajectory.points else None
        end = start + (_seconds(rest) if rest is not None else 0.0)
        contact, peak = (None, None) if door is None else _opening(door, starts[-1][0], end)
        after = ((contact, "post"), (peak, plan.ending))
        hits.append(Hit(plan, starts + [(time, name) for time, name in after if time is not None],
                        end, contact, peak))
    return hits


def _phase_starts(plan: Any, start: float, trajectory: Any) -> list[tuple[float, str]]:
    """Return the starts of the phases up to the contact, if a trajectory is that of a plan."""
    column = {name: index for index, name in enumerate(trajectory.joint_names)}
    knots = np.array([point.positions for point in trajectory.points])
    found: list[tuple[float, str]] = []
    first = 0  # knot from which on the next phase is looked for
    for phase in plan.phases:
        planned = phase.trajectory
        if not len(knots) or not planned.points or not set(planned.joint_names) <= set(column):
            return []
        wanted = np.array(planned.points[0].positions)
        rows = knots[first:, [column[name] for name in planned.joint_names]]
        same = np.flatnonzero(np.abs(rows - wanted).max(axis=1) < _SAME)
        if not same.size:
            return []
        first += int(same[0])
        found.append((start + _seconds(trajectory.points[first].time_from_start), phase.name))
        if phase.name == _RUN_UP:
            return found
    return []


def _opening(door: Series, begin: float, end: float) -> tuple[float | None, float | None]:
    """Find when a door that stood at `begin` starts to open, and its first largest angle [s]."""
    rows = np.flatnonzero((door.t >= begin) & (door.t <= end))
    t, angle = door.t[rows], door.values[rows, 0]
    moved = np.flatnonzero((angle > angle[:1] + _MOVED) & (t < begin + _LONGEST))
    if not moved.size:
        return None, None
    first = max(int(moved[0]) - 1, 0)
    fallen = np.flatnonzero(np.maximum.accumulate(angle) - angle > _MOVED)
    fallen = fallen[fallen > first]
    top = angle[first:fallen[0]] if fallen.size else angle[first:]
    return float(t[first]), float(t[first + int(np.argmax(top))])


def _seconds(duration: Any) -> float:
    return float(duration.sec + 1e-9 * duration.nanosec)
