"""The checks before a plan moves a robot; a dry run makes the same checks."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.knots import Knots
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.splice import cut
from humanoid_motion.tolerances import OVERSHOOT, ROUNDING, SPEED_OVERSHOOT, START
from impact_planner.errors import GoalRefused
from impact_planner.task.settings import ENDINGS

from motion_execution.hit.types import PLANNED, ExecutablePlan
from motion_execution.judge import farthest

DOOR_TOLERANCE = 0.02  # largest distance of the door from the angle at which it is hit [rad]
SLOWEST = 0.05  # smallest speed_scale
_JOIN = 0.01  # largest distance between the end of a phase and the start of the next one [rad]
_SAMPLES = 9  # number of samples of each segment between two knots, with both ends


def require_speed_scale(scale: float) -> None:
    """Check the speed_scale of a goal.

    Raises:
        GoalRefused: The speed_scale is out of its range.
    """
    if not SLOWEST <= scale <= 1.0:
        raise GoalRefused("invalid_goal", f"speed_scale is {scale:g}, must be from {SLOWEST} to 1",
                          quantity="speed_scale", value=scale, limit=(SLOWEST, 1.0))


def require_ready(
    robot: RobotModel, plan: ExecutablePlan, position: Array, door_off: float
) -> None:
    """Check the plan against the robot's limits and against the present state of robot and door.

    Args:
        robot: The robot.
        plan: The plan.
        position: Present joint positions, (J,) [rad].
        door_off: Present angle of the door minus the angle at which it is to be hit [rad].

    Raises:
        GoalRefused: The goal cannot be executed.
    """
    require_start(robot.joint_names, position, plan.phases["prepare"].position[0])
    require_door(door_off)
    require_limits(robot, plan)


def require_start(names: Sequence[str], position: Array, start: Array) -> None:
    """Check that the robot is in the posture in which the plan starts.

    Args:
        names: Joint names.
        position: Present joint positions, (J,) [rad].
        start: Joint positions at the start of the plan, (J,) [rad].

    Raises:
        GoalRefused: A joint is too far from the start.
    """
    name, off = farthest(position, start, names)
    if not off <= START:
        raise GoalRefused(
            "not_ready",
            f"the robot is not where the plan starts: {name} is off by {off:.3f} rad, "
            f"at most {START} rad are allowed; bring the robot back to its initial posture "
            "(in simulation: sim/reset)",
            quantity=f"{name} [rad]", value=off, limit=START)


def require_door(off: float) -> None:
    """Check that the door stands at the angle at which it is to be hit.

    Args:
        off: Present angle of the door minus the angle at which it is to be hit [rad].

    Raises:
        GoalRefused: The difference is too large or no number.
    """
    if not abs(off) <= DOOR_TOLERANCE:  # NaN is refused
        raise GoalRefused(
            "not_ready",
            f"the door stands {np.degrees(off):.1f} deg from where the plan hits it, at most "
            f"{np.degrees(DOOR_TOLERANCE):.1f} deg are allowed",
            quantity="door_angle [rad]", value=off, limit=DOOR_TOLERANCE)


def require_limits(robot: RobotModel, plan: ExecutablePlan) -> None:
    """Check that a plan, whoever made it, is continuous and keeps the limits of the URDF.

    The driver checks each trajectory that is sent, but the later ones are sent after the hit.

    Raises:
        GoalRefused: A phase does not begin where the previous phase ends, or a joint would leave
            its range or exceed its speed limit.
    """
    _require_joined(robot, plan)
    for phase, knots in plan.phases.items():
        _require_inside(robot, knots, phase)


def _require_joined(robot: RobotModel, plan: ExecutablePlan) -> None:
    ends = {**plan.phases, "cam": cut(plan.phases["cam"], plan.switch_time)}
    joints = list(itertools.pairwise(PLANNED))
    joints += [(PLANNED[-1], name) for name in ENDINGS if name in plan.phases]
    for before, after in joints:
        name, off = farthest(
            plan.phases[after].position[0], ends[before].position[-1], robot.joint_names)
        if not off <= _JOIN:
            raise GoalRefused(
                "no_plan",
                f"the plan jumps: {name} is {off:.3f} rad apart between the "
                f"phases {before} and {after}, at most {_JOIN} rad are allowed",
                quantity="jump [rad]", value=off, limit=_JOIN)


def _require_inside(robot: RobotModel, knots: Knots, phase: str) -> None:
    share = np.linspace(0.0, 1.0, _SAMPLES)[1:-1]
    between = (knots.time[:-1, None] + np.diff(knots.time)[:, None] * share).ravel()
    position, velocity, _ = knots.at(between)
    least, most, speed = robot.lower, robot.upper, robot.speed_limit
    for values, lower, upper, unit in (
            (knots.position, least - ROUNDING, most + ROUNDING, "rad"),
            (position, least - OVERSHOOT, most + OVERSHOOT, "rad"),
            (np.abs(knots.velocity), 0.0 * speed, (1.0 + ROUNDING) * speed, "rad/s"),
            (np.abs(velocity), 0.0 * speed, SPEED_OVERSHOOT * speed, "rad/s")):
        outside = np.argwhere(~((values >= lower) & (values <= upper)))  # NaN, too
        if len(outside):
            i, j = outside[0]
            value, limit = float(values[i, j]), (float(lower[j]), float(upper[j]))
            raise GoalRefused(
                "no_plan", f"in the phase {phase}, {robot.joint_names[j]} would reach {value:.3f} "
                f"{unit}, allowed are {limit[0]:.3f} to {limit[1]:.3f} {unit}",
                quantity=f"{robot.joint_names[j]} [{unit}]", value=value, limit=limit)
