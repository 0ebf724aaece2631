"""Conversions between the executor's messages and its library."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_msgs.msg import HitReport, ImpactPlan
from impact_planner.errors import GoalRefused, InvalidRequest
from impact_planner.motion.missed import STANDS
from impact_planner.ros.messages import knots_from_message
from robot_driver.motion import Outcome

from motion_execution.hit.types import ExecutablePlan, Measured

Result = ExecuteDoorImpact.Result

_ENDINGS = {  # error code of each outcome, and the message if the execution gives no reason
    Outcome.SUCCESS: (Result.NONE, "the door was opened and held"),
    Outcome.NO_CONTACT: (Result.NO_CONTACT, "the run-up ended without a hit"),
    Outcome.STOPPED: (Result.STOPPED, "the motion was stopped"),
    Outcome.FELL: (Result.FELL, "the robot fell"),
    Outcome.NOT_FOLLOWED: (Result.DRIVER_REFUSED, "the driver does not follow the trajectory"),
    Outcome.NOT_HELD: (Result.NOT_HELD, "the door is not held"),
    Outcome.LOCKED: (Result.LOCKED, "the leaf is locked"),
}
# Names of the fields that measurements and hit report share.
_REPORTED = ("contact_delay", "switch_latency", "v_rb", "v_rb_post", "omega_door", "peak_angle",
             "peak_time")


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


def probes(goal: Any, plan: ImpactPlan) -> bool:
    """Whether the leaf is to be touched before the run-up of a goal's plan.

    Raises:
        GoalRefused: The goal's `probe` is none of the action's constants.
    """
    known = (goal.AUTO, goal.ON, goal.OFF)
    if goal.probe not in known:
        raise GoalRefused("invalid_goal", f"probe is {goal.probe}, must be {known[0]} (AUTO), "
                          f"{known[1]} (ON) or {known[2]} (OFF)", quantity="probe",
                          value=goal.probe, limit=known)
    return goal.probe == goal.ON or (goal.probe == goal.AUTO and not plan.missed_margin >= STANDS)


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
