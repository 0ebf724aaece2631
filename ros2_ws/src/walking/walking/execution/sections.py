"""Sections of a walk: each one ends with the robot standing still on two feet.

A driver that has a section needs no further message: it goes on to the next boundary between two
steps, and comes to rest there. Silence, a crash of the node and a lost link are therefore safe.
"""

from __future__ import annotations

import numpy as np
from humanoid_motion.knots import Knots
from humanoid_motion.robot_model import RobotModel

from walking.pattern.plan import plan_walk
from walking.pattern.settings import WalkSettings
from walking.pattern.walk_plan import WalkPlan

_SAME_TIME = 1e-6  # largest difference of equal times [s]


def stop_plan(robot: RobotModel, plan: WalkPlan, step: int, settings: WalkSettings) -> WalkPlan:
    """Plan how a walk comes to rest at a boundary between two steps.

    The distances between the robot's bodies are not checked again: legs and arms are within their
    places in the walk.

    Args:
        robot: The robot.
        plan: The walk.
        step: Number of footsteps that are made before.
        settings: Settings of the walk.

    Raises:
        WalkInfeasible: The robot cannot come to rest there.
        HumanoidMotionError: A leg does not reach, or a joint exceeds a limit.
    """
    return plan_walk(robot, plan.boundaries[step], [], settings, clearance=False)


def section(plan: WalkPlan, step: int, stop: WalkPlan, begin: float = 0.0) -> Knots:
    """Join a walk up to a boundary and the motion to rest from there.

    Args:
        plan: The walk.
        step: Number of footsteps that are made.
        stop: Motion to rest from that boundary, of `stop_plan`.
        begin: Time of the walk before which knots are left out, because the driver has passed them
            [s]. One knot before it is kept.

    Returns:
        The knots; times count from the beginning of the walk.
    """
    boundary = plan.begin_of(step)
    knots = plan.knots
    first = max(0, int(np.searchsorted(knots.time, begin, side="right")) - 1)
    last = int(np.searchsorted(knots.time, boundary - _SAME_TIME))
    first = min(first, last)
    kept = slice(first, last)  # without the boundary, with which the stop begins
    return Knots(
        np.concatenate([knots.time[kept], boundary + stop.knots.time]),
        np.vstack([knots.position[kept], stop.knots.position]),
        np.vstack([knots.velocity[kept], stop.knots.velocity]),
        np.vstack([knots.acceleration[kept], stop.knots.acceleration]))


