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


def require_ready(robot: RobotModel, plan: ExecutablePlan, sent: Knots, position: Array,
                  door_off: float) -> None:
    """Check the plan against the robot's limits and against the present state of robot and door.

    Args:
        robot: The robot.
        plan: The plan.
        sent: First trajectory, as it would be sent: up to the end of the run-up or the probe.
        position: Present joint positions, (J,) [rad].
        door_off: Present angle of the door minus the angle at which it is to be hit [rad].

    Raises:
        GoalRefused: The goal cannot be executed.
    """
    require_start(robot.joint_names, position, plan.phases["prepare"].position[0])
    require_door(door_off)
    require_limits(robot, plan, sent)


def require_start(names: Sequence[str], position: Array, start: Array) -> None:
    """Check that the robot is in the posture in which the plan starts.

    Args:
        names: Joint names.
        position: Present joint positions, (J,) [rad].
        start: Joint positions at the start of the plan, (J,) [rad].

    Raises:
        GoalRefused: A joint is too far from the start.
    """
    off = np.abs(position - start)
    worst = int(np.argmax(off))
    if off[worst] > START:
        raise GoalRefused(
            "not_ready",
            f"the robot is not where the plan starts: {names[worst]} is off by {off[worst]:.3f} "
            f"rad, at most {START} rad are allowed; bring the robot back to its initial "
            "posture (in simulation: sim/reset)",
            quantity=f"{names[worst]} [rad]", value=float(off[worst]), limit=START)


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


def require_limits(robot: RobotModel, plan: ExecutablePlan, sent: Knots) -> None:
    """Check that a plan, whoever made it, is continuous and keeps the limits of the URDF.

    Args:
        robot: The robot.
        plan: The plan.
        sent: First trajectory, as it would be sent.

    Raises:
        GoalRefused: A phase does not begin where the previous phase ends, or a joint would leave
            its range or exceed its speed limit.
    """
    _require_joined(robot, plan)
    _require_inside(robot, sent, "up to the end of the run-up")
    for name in (*PLANNED[-2:], *sorted(set(ENDINGS) & set(plan.phases))):
        _require_inside(robot, plan.phases[name], f"in the phase {name}")


def _require_joined(robot: RobotModel, plan: ExecutablePlan) -> None:
    ends = {**plan.phases, "cam": cut(plan.phases["cam"], plan.switch_time)}
    joints = list(itertools.pairwise(PLANNED))
    joints += [(PLANNED[-1], name) for name in ENDINGS if name in plan.phases]
    for before, after in joints:
        off = np.abs(plan.phases[after].position[0] - ends[before].position[-1])
        worst = int(np.argmax(off))
        if off[worst] > _JOIN:
            raise GoalRefused(
                "no_plan",
                f"the plan jumps: {robot.joint_names[worst]} is {off[worst]:.3f} rad apart between "
                f"the phases {before} and {after}, at most {_JOIN} rad are allowed",
                quantity="jump [rad]", value=float(off[worst]), limit=_JOIN)


def _require_inside(robot: RobotModel, knots: Knots, where: str) -> None:
    _require_range(robot, knots.position, knots.velocity, where, ROUNDING, 1.0 + ROUNDING)
    share = np.linspace(0.0, 1.0, _SAMPLES)[1:-1]
    between = (knots.time[:-1, None] + np.diff(knots.time)[:, None] * share).ravel()
    position, velocity, _ = knots.at(between)
    _require_range(robot, position, velocity, where, OVERSHOOT, SPEED_OVERSHOOT)


def _require_range(robot: RobotModel, position: Array, velocity: Array, where: str,
                   slack: float, factor: float) -> None:
    """Check joint positions, (N, J) [rad], and joint speeds, (N, J) [rad/s]; NaN is refused.

    Args:
        robot: The robot.
        position: Joint positions.
        velocity: Joint speeds.
        where: Part of the plan, for the message.
        slack: Largest distance outside the range of a joint [rad].
        factor: Largest share of the speed limit of a joint.

    Raises:
        GoalRefused: A joint would leave its range or exceed its speed limit.
    """
    inside = (position >= robot.lower - slack) & (position <= robot.upper + slack)
    if not inside.all():
        i, j = np.argwhere(~inside)[0]
        raise GoalRefused(
            "no_plan",
            f"{where}, {robot.joint_names[j]} would go to {position[i, j]:.3f} rad, its range is "
            f"{robot.lower[j]:.3f} to {robot.upper[j]:.3f} rad",
            quantity=f"{robot.joint_names[j]} [rad]", value=float(position[i, j]),
            limit=(float(robot.lower[j]), float(robot.upper[j])))
    slow = np.abs(velocity) <= factor * robot.speed_limit
    if not slow.all():
        i, j = np.argwhere(~slow)[0]
        raise GoalRefused(
            "no_plan",
            f"{where}, {robot.joint_names[j]} would turn at {abs(velocity[i, j]):.2f} rad/s, its "
            f"limit is {robot.speed_limit[j]:.2f} rad/s",
            quantity=f"{robot.joint_names[j]} [rad/s]", value=float(velocity[i, j]),
            limit=float(robot.speed_limit[j]))
