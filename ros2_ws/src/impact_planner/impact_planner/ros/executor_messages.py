"""What the executor reads from messages, and its result. Only its node needs this module."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_msgs.msg import HitReport, ImpactPlan

from impact_planner.errors import GoalRefused, InvalidRequest
from impact_planner.execution.types import ExecutablePlan, Measured, Outcome
from impact_planner.ros.messages import knots_from_message

Result = ExecuteDoorImpact.Result

_ENDINGS = {  # error code, and what is said where the execution gives no reason
    Outcome.SUCCESS: (Result.NONE, "the door was opened and held"),
    Outcome.NO_CONTACT: (Result.NO_CONTACT, "the run-up ended without a hit"),
    Outcome.STOPPED: (Result.STOPPED, "stopped"),
    Outcome.FELL: (Result.FELL, "the robot fell"),
    Outcome.NOT_FOLLOWED: (Result.DRIVER_REFUSED, "the driver does not follow"),
    Outcome.NOT_HELD: (Result.NOT_HELD, "the door is not held"),
}
_REPORTED = ("contact_delay", "switch_latency", "v_rb", "v_rb_post", "omega_door", "peak_angle",
             "peak_time")  # by the same names in both
_UNIT = 0.1  # a quaternion's length may be so far from 1


def joint_arrays(message: Any, names: Sequence[str]) -> tuple[Array, Array] | None:
    """Positions [rad] and speeds [rad/s] of a JointState, (30,) each, in the order of `names`.

    Further joints are left out; None where one is missing or no number.
    """
    given = list(message.name)
    if not (len(given) == len(message.position) == len(message.velocity)
            and set(names) <= set(given)):
        return None
    position, velocity = np.array(message.position), np.array(message.velocity)
    if given != list(names):  # another driver may order them otherwise
        order = [given.index(name) for name in names]
        position, velocity = position[order], velocity[order]
    if not (np.isfinite(position).all() and np.isfinite(velocity).all()):
        return None
    return position, velocity


def trunk_tilt(message: Any) -> float | None:
    """Angle between the trunk's z axis and the vertical by an Imu's orientation [rad].

    None where the message has no orientation: a covariance that begins with -1, or no unit
    quaternion.
    """
    q = message.orientation
    length = math.sqrt(q.x**2 + q.y**2 + q.z**2 + q.w**2)
    if message.orientation_covariance[0] == -1.0 or not abs(length - 1.0) < _UNIT:
        return None
    return math.acos(max(-1.0, min(1.0, 1.0 - 2.0 * (q.x**2 + q.y**2) / length**2)))


def executable(plan: ImpactPlan, names: Sequence[str]) -> ExecutablePlan:
    """What the execution needs of a plan, with columns in the order of `names`.

    Raises:
        GoalRefused: A phase is missing or makes no sense.
    """
    try:
        phases = {phase.name: knots_from_message(phase.trajectory, names)
                  for phase in (*plan.phases, *plan.branches)}
        return ExecutablePlan.of(plan, phases)
    except InvalidRequest as error:
        raise GoalRefused("no_plan", str(error), quantity=error.quantity,
                          value=error.value) from error
    except (ValueError, ZeroDivisionError) as error:
        raise GoalRefused("no_plan", f"the plan makes no sense: {error}") from error


def result_message(outcome: Outcome, reason: str, measured: Measured) -> Any:
    """The action's result at the end of an execution."""
    code, usual = _ENDINGS[outcome]
    return Result(success=outcome is Outcome.SUCCESS, error_code=code, message=reason or usual,
                  **asdict(measured))


def hit_report(plan: ImpactPlan, measured: Measured, stamp: Any) -> HitReport:
    """What is told of a hit.

    Args:
        plan: That was executed.
        measured: What was felt.
        stamp: builtin_interfaces/Time.
    """
    report = HitReport(plan_id=plan.plan_id, door=plan.door)
    report.header.stamp = stamp
    for name in _REPORTED:
        setattr(report, name, float(getattr(measured, name)))
    return report
