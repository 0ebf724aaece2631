"""Conversions of plans, knots, requests and doors; they need the message packages only."""

import math
from dataclasses import replace

import numpy as np
import pytest
from humanoid_motion.errors import HumanoidMotionError

pytest.importorskip("door_impact_msgs.msg")

from builtin_interfaces.msg import Time
from door_impact_common.driver.messages import trajectory_message
from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_msgs.msg import CloserParameters
from door_impact_msgs.srv import PlanDoorImpact
from door_model.door.door import Zone
from impact_planner import errors
from impact_planner.execution.types import Measured, Outcome
from impact_planner.ros.executor_messages import hit_report
from impact_planner.ros.messages import (
    door_from_message,
    failure_response,
    knots_from_message,
    plan_message,
    request_from_message,
)
from impact_planner.task.experience import Experience
from unique_identifier_msgs.msg import UUID


def closer(known, **changes):
    """The message of an identifier for the paper's door."""
    message = CloserParameters(door="paper", leaf_width=known.width)
    door = known.door
    for name in ("i_a", "c_c", "k_c", "tau_c0_prime"):
        setattr(message, name, getattr(door, name))
    for name in ("l", "l1", "l2", "l3"):
        setattr(message, f"link_{name}", getattr(door.closer, name))
    message.theta_i0 = door.closer.theta_i0
    message.identified = ["i_a", "c_c", "k_c", "tau_c0_prime"]
    message.covariance = np.diag([0.1, 1e-4, 1e-3, 1e-2]).ravel().tolist()
    message.warnings = ["a warning"]
    for name, value in changes.items():
        setattr(message, name, value)
    return message


def test_knots_survive_the_message(robot, plan):
    """The times of every phase are the same to a nanosecond, the positions to the bit."""
    for phase in plan.phases:
        message = trajectory_message(phase.knots, robot.joint_names)
        again = knots_from_message(message, robot.joint_names)
        np.testing.assert_allclose(again.time, phase.knots.time, atol=1e-9)
        for name in ("position", "velocity", "acceleration"):
            np.testing.assert_array_equal(getattr(again, name), getattr(phase.knots, name))


def test_joints_in_another_order_are_sorted_by_name(robot, plan):
    """The columns follow the given names, and a missing joint is an error."""
    knots = plan.phase("step").knots
    message = trajectory_message(knots, robot.joint_names)
    backwards = list(reversed(robot.joint_names))
    np.testing.assert_array_equal(
        knots_from_message(message, backwards).position, knots.position[:, ::-1]
    )
    with pytest.raises(ValueError, match="NO_SUCH_JOINT"):
        knots_from_message(message, ["NO_SUCH_JOINT"])


def test_scalars_of_the_message_are_the_plan_s(robot, plan):
    """Equal names have equal numbers, and trajectories are there only on request."""
    short = plan_message(plan, robot.joint_names, Time(sec=3), trajectories=False)
    assert short.header.frame_id == "odom"
    assert short.header.stamp.sec == 3
    assert len(short.phases) == 0
    for name in ("omega_door", "v_rb", "effective_mass", "peak_time", "b_r", "switch_time"):
        assert getattr(short, name) == getattr(plan, name)
    assert short.effective_mass_model == plan.effective_mass_model > 0.0
    assert short.learned_hits == 0
    known = replace(plan.known, experience=replace(Experience.none(0.5), hits=3))
    hit = replace(plan.hit, transfer=replace(plan.hit.transfer, model_mass=55.5))
    taught = replace(plan, known=known, hit=hit)
    message = plan_message(taught, robot.joint_names, Time(), trajectories=False)
    assert (message.learned_hits, message.effective_mass_model) == (3, 55.5)
    assert [m.phase for m in short.zmp_margins] == [phase.name for phase in plan.phases]
    assert short.right_foot.position.y == plan.right_foot[1]
    assert short.right_foot.orientation.w == 1.0
    whole = plan_message(plan, robot.joint_names, Time(), trajectories=True)
    assert [phase.name for phase in whole.phases] == [phase.name for phase in plan.phases]
    for phase in whole.phases:
        assert len(phase.com) == len(phase.zmp) == len(phase.trajectory.points)


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


def test_negative_numbers_and_empty_words_mean_as_configured():
    """These are the message's defaults; NaN and zero are kept for the planner to check."""
    request = request_from_message(PlanDoorImpact.Request(desired_opening_angle=0.4))
    assert request.desired_opening_angle == 0.4
    assert request.restitution is None
    assert request.l_b is None
    assert request.run_up is None
    given = request_from_message(
        PlanDoorImpact.Request(
            desired_opening_angle=-0.4, restitution=0.0, door_distance=math.nan, ending="hold"
        )
    )
    assert given.desired_opening_angle == -0.4
    assert given.restitution == 0.0
    assert math.isnan(given.door_distance)
    assert given.ending == "hold"


def test_door_of_an_identification(known):
    """The door has the parameters, the covariance and the warnings of the message."""
    found = door_from_message(closer(known))
    assert found.door == known.door
    assert found.covariance[3, 3] == 1e-2
    assert found.warnings == ("a warning",)
    assert door_from_message(closer(known, covariance=[0.0] * 16)).covariance is None


def test_a_door_keeps_its_assembly_its_zones_and_its_friction(known):
    """What the message has beyond the paper's parameters arrives in the door as well."""
    found = door_from_message(closer(
        known, assembly=-1.0, friction=0.3, c_c_closing=0.08, backcheck_angle=1.2,
        backcheck_c_c=0.5, latch_angle=0.1, latch_c_c=0.02)).door
    assert found.closer.assembly == -1.0
    assert found.friction == 0.3
    assert found.c_c_closing == 0.08
    assert found.backcheck == Zone(1.2, 0.5)
    assert found.latch == Zone(0.1, 0.02)


@pytest.mark.parametrize(
    "changes",
    [{"i_a": 0.0}, {"link_l3": 0.9}],
)
def test_parameters_that_are_no_door_are_refused(known, changes):
    """A door has inertia, a linkage that closes, and a leaf of some width."""
    with pytest.raises(errors.NoDoor, match="/closer_parameters"):
        door_from_message(closer(known, **changes))


NUMBERS = [name for name, kind in CloserParameters.get_fields_and_field_types().items()
           if kind == "double"]


def test_a_number_that_is_not_finite_is_refused_by_its_name(known):
    """NaN and infinity are no values of any quantity; the error names the field."""
    for name in NUMBERS:
        with pytest.raises(errors.NoDoor, match=name):
            door_from_message(closer(known, **{name: math.nan}))


def test_a_negative_size_is_refused_by_its_name(known):
    """A standard deviation, a mass and a residual are 0 or above."""
    with pytest.raises(errors.NoDoor, match="i_a_std"):
        door_from_message(closer(known, i_a_std=-0.1))


def changed(row, column, value, mirrored):
    """A covariance of four parameters with other values at a place and at the mirrored place."""
    covariance = np.diag([0.1, 1e-4, 1e-3, 1e-2])
    covariance[column, row] = mirrored
    covariance[row, column] = value
    return covariance


@pytest.mark.parametrize("covariance", [
    changed(1, 1, math.nan, 0.0),
    changed(0, 3, 0.01, 0.0),  # not symmetric
    np.eye(4) - 0.6 * (np.ones((4, 4)) - np.eye(4)),  # each pair is possible, all four are not
])  # fmt: skip
def test_a_covariance_that_no_random_numbers_have_is_refused(known, covariance):
    """Covariances are finite, symmetric and not negative in any direction."""
    with pytest.raises(errors.NoDoor, match=r"/closer_parameters.*covariance"):
        door_from_message(closer(known, covariance=covariance.ravel().tolist()))


@pytest.mark.parametrize(("identified", "reason"), [
    (["i_a", "c_c", "k_c", "k_c"], "k_c"),
    (["i_a", "c_c", "k_c", "backcheck_angle"], "backcheck_angle"),
])
def test_names_of_what_was_identified_are_checked(known, identified, reason):
    """A name is known, comes once, and belongs to a parameter that the message has."""
    with pytest.raises(errors.NoDoor, match=rf"/closer_parameters.*identified.*{reason}"):
        door_from_message(closer(known, identified=identified))


def test_each_error_has_its_code():
    """Each error code of the service belongs to a class of errors."""
    codes = set()
    for kind in (*errors.PlannerError.__subclasses__(), *HumanoidMotionError.__subclasses__()):
        response = failure_response(PlanDoorImpact.Response(), kind("because"))
        assert not response.success
        assert response.message == "because"
        codes.add(response.error_code)
    assert codes == set(range(1, 7))
