"""Conversions between the messages of hits and the library."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from door_impact_common.errors import DoorImpactError
from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_msgs.msg import HitReport, ImpactPlan
from impact_planner.errors import GoalRefused, InvalidRequest
from impact_planner.ros.messages import knots_from_message
from robot_driver.motion import Outcome

from motion_execution.hit.execution import Execution
from motion_execution.hit.types import Measured
from motion_execution.mission.errors import CODES
from motion_execution.mission.hit_plan import HitPlan
from motion_execution.mission.hits import PROBES

Result = ExecuteDoorImpact.Result

_SENTENCES = {  # the message if the execution gives no reason
    Outcome.SUCCESS: "the door was opened and held",
    Outcome.NO_CONTACT: "the run-up ended without a hit",
    Outcome.STOPPED: "the motion was stopped",
    Outcome.FELL: "the robot fell",
    Outcome.NOT_FOLLOWED: "the driver does not follow the trajectory",
    Outcome.NOT_HELD: "the door is not held",
    Outcome.LOCKED: "the leaf is locked",
}
# Names of the fields that measurements and hit report share.
_REPORTED = ("contact_delay", "switch_latency", "v_rb", "v_rb_post", "omega_door", "peak_angle",
             "peak_time")


def hit_plan_of(plan: ImpactPlan, names: Sequence[str]) -> HitPlan:
    """Convert a plan's message to what its execution needs.

    Args:
        plan: The message, with its trajectories.
        names: Joint names in the order of the knots' columns.

    Raises:
        GoalRefused: A phase is missing, or a number of the plan makes no sense.
    """
    places = [np.array((each.x, each.y)) for each in (
        plan.left_foot.position, plan.right_foot.position, plan.contact_point)]
    if not np.isfinite(places).all():
        raise GoalRefused("no_plan", f"soles or B of the plan are at {places}, must be finite",
                          quantity="left_foot, right_foot, contact_point [m]", value=places)
    try:
        phases = {phase.name: knots_from_message(phase.trajectory, names)
                  for phase in (*plan.phases, *plan.branches)}
        margins = {each.phase: each.margin for each in plan.zmp_margins}
        return HitPlan.of(plan, phases, margins, *places)
    except InvalidRequest as error:
        raise GoalRefused("no_plan", str(error), quantity=error.quantity,
                          value=error.value) from error
    except (ValueError, ZeroDivisionError) as error:
        raise GoalRefused("no_plan", f"the plan cannot be executed: {error}") from error


def probe_of(number: int) -> str:
    """Return the word for a goal's `probe`.

    Raises:
        GoalRefused: It is none of the action's constants.
    """
    if not 0 <= number < len(PROBES):
        raise GoalRefused("invalid_goal", f"probe is {number}, must be 0 (AUTO), 1 (ON) or 2 (OFF)",
                          quantity="probe", value=number, limit=(0, 2))
    return PROBES[number]


def code_of(result: Any, outcome: Outcome) -> int:
    """Return the error code of an action's result type for the outcome of a motion."""
    return int(getattr(result, CODES[outcome].upper()))


def error_code(error: DoorImpactError) -> int:
    """Return the action's error code of an error before the motion."""
    return int(getattr(Result, error.reason.upper(), Result.NO_PLAN))


def result_message(execution: Execution) -> Any:
    """Make the action's result from an execution that has ended."""
    outcome = execution.outcome
    return Result(error_code=code_of(Result, outcome), message=execution.reason or
                  _SENTENCES[outcome], **asdict(execution.measured))


def hit_report(
    plan: HitPlan, goal_id: Any, outcome: Outcome, measured: Measured, stamp: Any
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
                       error_code=code_of(Result, outcome))
    report.header.stamp = stamp
    for name in _REPORTED:
        setattr(report, name, float(getattr(measured, name)))
    return report
