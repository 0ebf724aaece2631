"""Finds the phases of the hits in a recording, and the moments of contact and of the peak.

The executor's goals are no topics that a recorder keeps. But every plan is recorded, and so are
the trajectories that the executor sends: a phase begins where a trajectory has the first knot of
the phase. The contact is that of the hit's report, or else the door's first movement.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from door_impact_common.arrays import Array

from door_impact_evaluation.report.bag import Bag, Series

_SAME = 1e-6      # largest difference of the joint angles of a knot and its copy [rad]
_MOVED = 0.005    # angle by which a door that is hit has moved [rad]
_LONGEST = 10.0   # time after the start of the run-up in which a contact is looked for [s]
_LAST_BEFORE_CONTACT = "cam"


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


def find_hits(bag: Bag) -> list[Hit]:
    """Finds the plans that were executed, in the order of their starts.

    Args:
        bag: The recording.
    """
    sent = sorted(bag.trajectories, key=lambda row: row[0])
    begun = []
    for number, (start, trajectory) in enumerate(sent):
        plans = [plan for received, plan in bag.plans if received <= start]
        starts = _phase_starts(plans[-1], start, trajectory) if plans else []
        if starts:
            begun.append((number, plans[-1], starts))
    following = [number for number, _, _ in begun[1:]] + [len(sent)]
    return [_hit(bag, plan, starts, sent[number:end])
            for (number, plan, starts), end in zip(begun, following, strict=False)]


def _phase_starts(plan: Any, start: float, trajectory: Any) -> list[tuple[float, str]]:
    """Returns the starts of the phases up to the contact, if a trajectory is that of a plan."""
    if not trajectory.points:
        return []
    column = {name: index for index, name in enumerate(trajectory.joint_names)}
    knots = np.array([point.positions for point in trajectory.points])
    times = [_seconds(point.time_from_start) for point in trajectory.points]
    found: list[tuple[float, str]] = []
    first = 0  # knot from which on the next phase is looked for
    for phase in plan.phases:
        planned = phase.trajectory
        if not planned.points or not set(planned.joint_names) <= set(column):
            return []
        wanted = np.array(planned.points[0].positions)
        rows = knots[first:, [column[name] for name in planned.joint_names]]
        same = np.flatnonzero(np.abs(rows - wanted).max(axis=1) < _SAME)
        if not same.size:
            return []
        first += int(same[0])
        found.append((start + times[first], phase.name))
        if phase.name == _LAST_BEFORE_CONTACT:
            return found
    return []


def _hit(bag: Bag, plan: Any, starts: list[tuple[float, str]],
         sent: Sequence[tuple[float, Any]]) -> Hit:
    """Finds contact, peak and end of an executed plan.

    Args:
        bag: The recording.
        plan: Message ImpactPlan.
        starts: Starts of its phases up to the contact.
        sent: The trajectories of this execution, with their starts.
    """
    begin, run_up = starts[0][0], starts[-1][0]
    last, trajectory = sent[-1]
    end = last + (_seconds(trajectory.points[-1].time_from_start) if trajectory.points else 0.0)
    report = next((message for stamp, message in bag.reports
                   if stamp > begin and message.plan_id == plan.plan_id), None)
    door = bag.door.positions if bag.door is not None else None
    contact = None
    if report is not None:
        contact = _finite(run_up + plan.contact_time + report.contact_delay)
    elif door is not None:
        contact = _first_movement(door, run_up)
    if contact is None:
        return Hit(plan, starts, end, None, None)
    peak = None if report is None else _finite(contact + report.peak_time)
    if peak is None and door is not None:
        peak = _peak(door, contact, end)
    after = [(contact, "post")] + ([(peak, plan.ending)] if peak is not None else [])
    return Hit(plan, starts + after, end, contact, peak)


def _first_movement(door: Series, begin: float) -> float | None:
    """Returns the time at which a door that stood at `begin` starts to open [s]."""
    t, angle = door.t, door.values[:, 0]
    rows = np.flatnonzero((t >= begin) & (t < begin + _LONGEST))
    moved = rows[angle[rows] > angle[rows[:1]] + _MOVED]
    return float(t[max(int(moved[0]) - 1, 0)]) if moved.size else None


def _peak(door: Series, contact: float, end: float) -> float | None:
    """Returns the time of the largest angle before the door first falls back [s]."""
    rows = np.flatnonzero((door.t >= contact) & (door.t <= end))
    if rows.size < 2:
        return None
    angle: Array = door.values[rows, 0]
    highest = np.maximum.accumulate(angle)
    fallen = np.flatnonzero(highest - angle > _MOVED)
    top = angle[:fallen[0]] if fallen.size else angle
    return float(door.t[rows[int(np.argmax(top))]])


def _finite(time: float) -> float | None:
    return float(time) if math.isfinite(time) else None


def _seconds(duration: Any) -> float:
    return float(duration.sec + 1e-9 * duration.nanosec)
