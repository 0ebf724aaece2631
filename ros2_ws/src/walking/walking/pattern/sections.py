"""Sections of a walk: each one ends with the robot standing still on two feet.

A driver that has a section needs no further message: it goes on to the next boundary between two
steps, and comes to rest there. Silence, a crash of the node and a lost link are therefore safe.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from humanoid_motion.knots import Knots
from humanoid_motion.robot_model import RobotModel

from walking.pattern.plan import plan_walk
from walking.pattern.settings import WalkSettings
from walking.pattern.state import WalkState
from walking.pattern.timing import Phase
from walking.pattern.walk_plan import WalkPlan

_SAME_TIME = 1e-6  # largest difference of equal times [s]


@dataclass(frozen=True)
class Rest:
    """How a walk comes to rest from a boundary between two steps.

    Attributes:
        knots: The motion; times count from the boundary.
        phase: The phase in which the robot comes to rest on both feet.
        final: State at rest after it.
        plan: The walk that this motion is the end of.
        begin: Time of that walk at the boundary [s].
    """

    knots: Knots
    phase: Phase
    final: WalkState
    plan: WalkPlan
    begin: float


def rest_after(robot: RobotModel, plan: WalkPlan, step: int, settings: WalkSettings) -> Rest:
    """Return how a walk comes to rest after some of its footsteps.

    After the last one this is the walk's own end. The distances between the robot's bodies are not
    checked again: legs and arms are within their places in the walk.

    Args:
        step: Number of footsteps that are made before.

    Raises:
        WalkInfeasible: The robot cannot come to rest there.
        HumanoidMotionError: A leg does not reach, or a joint exceeds a limit.
    """
    if step == len(plan.footsteps):
        knots, boundary = plan.knots, plan.begin_of(step)
        end = knots.time >= boundary - _SAME_TIME
        rest = Knots(knots.time[end] - boundary, knots.position[end], knots.velocity[end],
                     knots.acceleration[end])
        return Rest(rest, plan.schedule.phases[-1], plan.final, plan, boundary)
    stop = plan_walk(robot, plan.boundaries[step], [], settings, clearance=False)
    return Rest(stop.knots, stop.schedule.phases[-1], stop.final, stop, 0.0)


def section(plan: WalkPlan, step: int, rest: Rest, begin: float = 0.0) -> Knots:
    """Join a walk up to a boundary and the motion to rest from there.

    Args:
        step: Number of footsteps that are made.
        rest: Motion to rest from that boundary, of `rest_after`.
        begin: Time of the walk before which knots are left out, because the driver has passed them
            [s]. One knot before it is kept.

    Returns:
        The knots; times count from the beginning of the walk.
    """
    boundary = plan.begin_of(step)
    knots, last = plan.knots, rest.knots
    stop = int(np.searchsorted(knots.time, boundary - _SAME_TIME))
    first = min(stop, max(0, int(np.searchsorted(knots.time, begin, side="right")) - 1))
    kept = slice(first, stop)  # without the boundary, with which the rest begins
    return Knots(
        np.concatenate([knots.time[kept], boundary + last.time]),
        np.vstack([knots.position[kept], last.position]),
        np.vstack([knots.velocity[kept], last.velocity]),
        np.vstack([knots.acceleration[kept], last.acceleration]))
