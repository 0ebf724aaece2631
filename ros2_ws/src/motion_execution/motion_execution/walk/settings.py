"""Thresholds of the execution of walks."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class ExecutionSettings:
    """Thresholds of the execution of walks.

    Attributes:
        lead: Time from sending a walk to its start [s]. Within it the driver goes from its present
            reference to the first posture of the walk.
        commit: Time before a step at which the motion of the step is sent [s]. Until then the
            driver has a trajectory that ends with the robot standing on two feet before this step.
        latest: Time after the begin of a step up to which its motion can still be sent [s]. The
            motions with and without the step differ by less than 0.1 mm of the CoM until then.
        splice: Time from handling a measurement to the driver's reaction [s].
        planning: Time that is kept for the planning of new footsteps while the robot walks [s].
        settle: Time after the end of the motion at which the robot is at rest [s].
        fall_tilt: Tilt of the trunk above which the robot has fallen [rad].
        tracking: Largest distance between a joint and its trajectory [rad]; a push that the robot
            withstands bends an ankle by up to 0.2 rad.
        apart: Distance between a trajectory and the one before it, over all joints, from which on
            the joints tell which of the two the driver follows [rad].
        missed: Share of the way from the earlier one to the later below which the driver has
            missed the later one.
        leaning: Tilt of the trunk above which `tracking` is not judged [rad]: a push or a fall has
            moved the joints, and the driver is not to blame.
        restarts: How often a walk that came to rest because a message was late is taken up again.
    """

    lead: float = 0.5
    commit: float = 0.2
    latest: float = 0.01
    splice: float = 0.005
    planning: float = 0.5
    settle: float = 0.1
    fall_tilt: float = math.radians(30.0)
    tracking: float = 0.3
    apart: float = 0.15
    missed: float = 0.25
    leaning: float = math.radians(5.0)
    restarts: int = 5
