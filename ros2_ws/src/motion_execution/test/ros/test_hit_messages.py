"""A plan's message may come from anywhere: every number that the executor uses is checked."""

import copy
import math

import numpy as np
import pytest

pytest.importorskip("door_impact_msgs.msg")

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus
from door_impact_msgs.action import ExecuteDoorImpact
from hypothesis import given
from hypothesis import strategies as st
from impact_planner.errors import GoalRefused
from impact_planner.ros.messages import plan_message
from motion_execution.hit.execution import Execution
from motion_execution.hit.point_b import PointB
from motion_execution.hit.preflight import require_ready
from motion_execution.hit.types import Measured
from motion_execution.ros.hit_messages import hit_plan_of, hit_report, probe_of
from robot_driver.intake import Arrival, Intake, Plausible
from robot_driver.messages import diagnostics
from robot_driver.motion import Outcome
from unique_identifier_msgs.msg import UUID

Goal = ExecuteDoorImpact.Goal
USED = ("contact_time", "switch_time", "slow_down", "rest_duration", "v_com", "v_com_post",
        "steady_way", "point_of_no_return", "stop_duration", "desired_opening_angle")


@pytest.fixture(scope="module")
def message(robot, plan):
    """The message of the planner's plan, with its trajectories."""
    return plan_message(plan, robot.joint_names, Time(), trajectories=True)


def checked(robot, message) -> Execution:
    """An execution after all checks, as the node makes it."""
    plan = hit_plan_of(message, robot.joint_names).executable
    execution = Execution(plan, PointB(robot))
    require_ready(robot, plan, plan.phases["prepare"].position[0], 0.0 - message.initial_angle)
    execution.start(0.0)
    return execution


@pytest.mark.parametrize(("forge", "words"), [
    (lambda m: setattr(m, "stop_duration", 1e9), "stop_duration"),
    (lambda m: setattr(m.left_foot.position, "y", math.nan), "soles or B"),
    (lambda m: m.branches[0].trajectory.points[3].velocities.__setitem__(3, math.nan),
     "must be finite")])
def test_a_number_that_makes_no_sense_is_refused_where_the_planners_plan_passes(
        robot, message, forge, words):
    assert checked(robot, message).planned_contact > 0.0
    forged = copy.deepcopy(message)
    forge(forged)
    with pytest.raises(GoalRefused, match=words) as refused:
        checked(robot, forged)
    assert refused.value.reason == "no_plan"


def test_another_word_for_the_probe_is_refused():
    assert [probe_of(each) for each in (Goal.AUTO, Goal.ON, Goal.OFF)] == ["auto", "on", "off"]
    with pytest.raises(GoalRefused, match="probe is 3") as refused:
        probe_of(3)
    assert refused.value.reason == "invalid_goal"


@given(st.dictionaries(st.sampled_from(USED), st.floats(), min_size=1))
def test_whatever_the_numbers_are_the_plan_is_refused_or_its_motions_can_be_made(
        robot, message, numbers):
    """A stop and the motion after a contact at any time end at rest, without an error."""
    forged = copy.deepcopy(message)
    for name, value in numbers.items():
        setattr(forged, name, value)
    try:
        execution = checked(robot, forged)
    except GoalRefused:
        return
    now = execution.planned_contact
    start = np.array(message.phases[0].trajectory.points[0].positions)
    execution.on_joints(now, start, 0.0 * start)
    for command in execution.on_door(now, 0.01, 0.5):
        assert abs(command.knots.velocity[-1]).max() < 1e-6


def test_diagnostics_name_what_was_dropped_or_late_and_who_else_publishes():
    intake = Intake({"/imu": Plausible(1.0)})
    nothing = diagnostics("motion_server", intake, {}, Time()).status[0]
    assert nothing.level == DiagnosticStatus.OK
    for stamp, value in ((1.0, 0.0), (1.2, 0.0), (1.3, 2.0)):
        intake.accept("/imu", Arrival(stamp, 1.3, 0.0), value, in_motion=True)
    noticed = diagnostics("motion_server", intake, {"/imu": ["/a", "/b"]}, Time()).status[0]
    assert noticed.level == DiagnosticStatus.WARN
    assert {v.value for v in noticed.values} == {"1", "0.300", "0.200", "/a, /b"}


def test_the_report_of_a_hit_names_its_goal_and_how_it_ended(plan):
    """The planner learns by goal and error code, and from the measured figures."""
    goal = UUID(uuid=range(16))
    measured = Measured(contact_delay=0.01, switch_latency=0.012, v_rb_post=0.07, peak_angle=0.43)
    report = hit_report(plan, goal, Outcome.NOT_HELD, measured, Time(sec=5))
    assert (report.plan_id, report.door, report.header.stamp.sec) == (plan.plan_id, "paper", 5)
    assert bytes(report.goal_id.uuid) == bytes(range(16))
    assert report.error_code == ExecuteDoorImpact.Result.NOT_HELD
    assert (report.contact_delay, report.switch_latency) == (0.01, 0.012)
    assert (report.v_rb_post, report.peak_angle) == (0.07, 0.43)
    assert math.isnan(report.v_rb)
