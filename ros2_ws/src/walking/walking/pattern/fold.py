"""Folding the arms of a robot that stands, before it walks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from humanoid_motion.knots import Knots
from humanoid_motion.motion import min_jerk_course
from humanoid_motion.robot_model import RobotModel

from walking.pattern.plan import plan_walk
from walking.pattern.settings import WalkSettings
from walking.pattern.state import WalkState
from walking.pattern.walk_plan import WalkPlan

_SPEED = 1.0  # largest speed of a joint of the upper body [rad/s]
_SHORTEST = 1.0  # shortest time of the motion [s]
_RISES = 0.4  # time after it in which the waist has risen [s]


def plan_fold(robot: RobotModel, state: WalkState, settings: WalkSettings) -> WalkPlan:
    """Plan how a robot that stands on both feet takes its upper body to half-sitting.

    Args:
        state: Where it stands; the legs go to half-sitting, too, and the feet stay.
        settings: Settings of the walk that follows.

    Raises:
        WalkInfeasible: The ZMP or friction would not be as required.
        HumanoidMotionError: A joint exceeds a limit, or bodies come too near to each other.
    """
    begin, end = state.upper.value, robot.config.half_sitting
    # 1.875 is the peak speed of a course of minimum jerk, for a way of 1 in a time of 1.
    duration = max(_SHORTEST, 1.875 * robot.folded_by(begin) / _SPEED)
    time = settings.period * np.arange(round(duration / settings.period) + 1)
    course = min_jerk_course(time, float(time[-1]))
    share, *rates = (np.asarray(rows[:, None] * (end - begin)) for rows in course)
    return plan_walk(
        robot, state, [], replace(settings, start=0.5 * duration, end=0.5 * duration + _RISES),
        upper=Knots(np.asarray(time), begin + share, *rates))
