"""Conversions between the executor's messages and its library."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from door_impact_common.arrays import Array
from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_msgs.msg import HitReport, ImpactPlan

from impact_planner.errors import GoalRefused, InvalidRequest
from impact_planner.execution.intake import Intake
from impact_planner.execution.types import ExecutablePlan, Measured, Outcome
from impact_planner.ros.messages import knots_from_message

Result = ExecuteDoorImpact.Result

_ENDINGS = {  # error code of each outcome, and the message if the execution gives no reason
    Outcome.SUCCESS: (Result.NONE, "the door was opened and held"),
    Outcome.NO_CONTACT: (Result.NO_CONTACT, "the run-up ended without a hit"),
    Outcome.STOPPED: (Result.STOPPED, "the motion was stopped"),
    Outcome.FELL: (Result.FELL, "the robot fell"),
    Outcome.NOT_FOLLOWED: (Result.DRIVER_REFUSED, "the driver does not follow the trajectory"),
    Outcome.NOT_HELD: (Result.NOT_HELD, "the door is not held"),
}
# Names of the fields that measurements and hit report share.
_REPORTED = ("contact_delay", "switch_latency", "v_rb", "v_rb_post", "omega_door", "peak_angle",
             "peak_time")
_UNIT = 0.1  # largest difference between the length of a unit quaternion and 1


def joint_arrays(message: Any, names: Sequence[str]) -> tuple[Array, Array] | None:
    """Read joint positions and joint speeds from a JointState.

    Args:
        message: The JointState; it may have further joints and any order.
        names: Joint names in the order of the result.

    Returns:
        Positions, (J,) [rad], and speeds, (J,) [rad/s]; None if a joint is missing or its position
        or speed is no finite number.
    """
    given = list(message.name)
    if not (len(given) == len(message.position) == len(message.velocity)
            and set(names) <= set(given)):
        return None
    position, velocity = np.array(message.position), np.array(message.velocity)
    if given != list(names):
        order = [given.index(name) for name in names]
        position, velocity = position[order], velocity[order]
    if not (np.isfinite(position).all() and np.isfinite(velocity).all()):
        return None
    return position, velocity


def trunk_tilt(message: Any) -> float | None:
    """Calculate the angle between the trunk's z axis and the vertical [rad].

    Args:
        message: Imu with the orientation of the trunk.

    Returns:
        The angle; None if the message has no orientation, that is, if its covariance begins with -1
        or it is no unit quaternion.
    """
    q = message.orientation
    length = math.sqrt(q.x**2 + q.y**2 + q.z**2 + q.w**2)
    if message.orientation_covariance[0] == -1.0 or not abs(length - 1.0) < _UNIT:
        return None
    return math.acos(max(-1.0, min(1.0, 1.0 - 2.0 * (q.x**2 + q.y**2) / length**2)))


def specific_force(message: Any) -> Array | None:
    """Read the specific force from an Imu, (3,) [m/s^2].

    None is returned if there is no accelerometer, that is, if the covariance begins with -1.
    """
    if message.linear_acceleration_covariance[0] == -1.0:
        return None
    force = message.linear_acceleration
    return np.array([force.x, force.y, force.z])


def executable(plan: ImpactPlan, names: Sequence[str]) -> ExecutablePlan:
    """Convert a plan's message to the plan of an execution.

    Args:
        plan: The message, with its trajectories.
        names: Joint names in the order of the knots' columns.

    Raises:
        GoalRefused: A phase is missing, or a number of the plan makes no sense.
    """
    foot = plan.left_foot.position
    if not (math.isfinite(foot.x) and math.isfinite(foot.y)):
        raise GoalRefused("no_plan", f"the plan's left foot is at ({foot.x:g}, {foot.y:g}) m",
                          quantity="left_foot [m]", value=(foot.x, foot.y))
    try:
        phases = {phase.name: knots_from_message(phase.trajectory, names)
                  for phase in (*plan.phases, *plan.branches)}
        return ExecutablePlan.of(plan, phases)
    except InvalidRequest as error:
        raise GoalRefused("no_plan", str(error), quantity=error.quantity,
                          value=error.value) from error
    except (ValueError, ZeroDivisionError) as error:
        raise GoalRefused("no_plan", f"the plan cannot be executed: {error}") from error


def result_message(outcome: Outcome, reason: str, measured: Measured) -> Any:
    """Make the action's result from the outcome, its reason (may be empty) and measurements."""
    code, default = _ENDINGS[outcome]
    return Result(success=outcome is Outcome.SUCCESS, error_code=code, message=reason or default,
                  **asdict(measured))


def hit_report(
    plan: ImpactPlan, goal_id: Any, outcome: Outcome, measured: Measured, stamp: Any
) -> HitReport:
    """Make the report of a hit, from which the planner learns.

    Args:
        plan: Plan that was executed.
        goal_id: The goal's unique_identifier_msgs/UUID.
        outcome: How the execution ended.
        measured: Measurements of the execution.
        stamp: End of the motion, a builtin_interfaces/Time.
    """
    report = HitReport(plan_id=plan.plan_id, door=plan.door, goal_id=goal_id,
                       error_code=_ENDINGS[outcome][0])
    report.header.stamp = stamp
    for name in _REPORTED:
        setattr(report, name, float(getattr(measured, name)))
    return report


def diagnostics(
    intake: Intake, crowded: Mapping[str, Sequence[str]], stamp: Any
) -> DiagnosticArray:
    """Make the message for /diagnostics.

    Args:
        intake: The checks of the messages, with what they have noticed.
        crowded: Names of the publishers of each topic that has more than one.
        stamp: Present time, a builtin_interfaces/Time.
    """
    noticed = intake.noticed()
    noticed.update({f"publishers of {topic}": ", ".join(names)
                    for topic, names in sorted(crowded.items())})
    status = DiagnosticStatus(
        name="impact_executor: inputs", hardware_id="impact_executor",
        level=DiagnosticStatus.WARN if noticed else DiagnosticStatus.OK,
        message="; ".join(noticed) or "every message was in time and made sense",
        values=[KeyValue(key=key, value=value) for key, value in noticed.items()])
    array = DiagnosticArray(status=[status])
    array.header.stamp = stamp
    return array
