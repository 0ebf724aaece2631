"""Conversions of plans, knots, requests and doors; they need the message packages only."""

import math
from dataclasses import replace

import numpy as np
import pytest
from humanoid_motion.errors import HumanoidMotionError

pytest.importorskip("door_impact_msgs.msg")

from builtin_interfaces.msg import Time
from door_impact_msgs.msg import CloserParameters
from door_impact_msgs.srv import PlanDoorImpact
from door_model.door.config import load_geometry
from door_model.door.door import Zone
from impact_planner import errors
from impact_planner.ros.messages import (
    door_from_message,
    failure_response,
    knots_from_message,
    plan_message,
    request_from_message,
)
from impact_planner.task.experience import Experience
from robot_driver.messages import trajectory_message


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
    backwards = list(reversed(robot.joint_names))
    for phase in plan.phases:
        message = trajectory_message(phase.knots, robot.joint_names)
        again = knots_from_message(message, robot.joint_names)
        np.testing.assert_allclose(again.time, phase.knots.time, atol=1e-9)
        for name in ("position", "velocity", "acceleration"):
            np.testing.assert_array_equal(getattr(again, name), getattr(phase.knots, name))
        np.testing.assert_array_equal(
            knots_from_message(message, backwards).position, phase.knots.position[:, ::-1])
    with pytest.raises(ValueError, match="NO_SUCH_JOINT"):
        knots_from_message(message, ["NO_SUCH_JOINT"])


def test_scalars_of_the_message_are_the_plan_s(robot, plan):
    """Equal names have equal numbers, and trajectories are there only on request."""
    known = replace(plan.known, experience=replace(Experience.none(0.5), hits=3))
    short = plan_message(replace(plan, known=known), robot.joint_names, Time(sec=3),
                         trajectories=False)
    assert (short.header.frame_id, short.header.stamp.sec) == ("odom", 3)
    assert (len(short.phases), short.learned_hits) == (0, 3)
    for name in ("omega_door", "v_rb", "effective_mass", "effective_mass_model", "peak_time",
                 "b_r", "switch_time"):
        assert getattr(short, name) == getattr(plan, name)
    assert [m.phase for m in short.zmp_margins] == [phase.name for phase in plan.phases]
    assert short.right_foot.position.y == plan.right_foot[1]
    whole = plan_message(plan, robot.joint_names, Time(), trajectories=True)
    assert [phase.name for phase in whole.phases] == [phase.name for phase in plan.phases]
    for phase in whole.phases:
        assert len(phase.com) == len(phase.zmp) == len(phase.trajectory.points)


def test_negative_numbers_and_empty_words_mean_as_configured():
    """These are the message's defaults; NaN and zero are kept for the planner to check."""
    request = request_from_message(PlanDoorImpact.Request(
        desired_opening_angle=-0.4, restitution=0.0, door_distance=math.nan, ending="hold"))
    assert (request.desired_opening_angle, request.restitution) == (-0.4, 0.0)
    assert (request.l_b, request.run_up, request.ending) == (None, None, "hold")
    assert math.isnan(request.door_distance)


def test_door_of_an_identification(known):
    """The door has the parameters, the covariance and the warnings of the message."""
    found = door_from_message(closer(known))
    assert found.door == known.door
    assert found.covariance[3, 3] == 1e-2
    assert found.warnings == ("a warning",)
    assert door_from_message(closer(known, covariance=[0.0] * 16)).covariance is None
    real = door_from_message(closer(
        known, assembly=-1.0, friction=0.3, c_c_closing=0.08, backcheck_angle=1.2,
        backcheck_c_c=0.5, latch_angle=0.1, latch_c_c=0.02)).door
    assert real == replace(
        known.door, closer=replace(known.door.closer, assembly=-1.0), friction=0.3,
        c_c_closing=0.08, backcheck=Zone(1.2, 0.5), latch=Zone(0.1, 0.02))


def test_an_identified_door_has_the_frame_of_the_door_of_its_name_around_its_own_leaf(known):
    geometry = load_geometry("paper")
    leaf, frame = door_from_message(closer(known, leaf_width=0.8), geometry).frame
    assert leaf.width == 0.8
    assert frame.width - leaf.width == pytest.approx(geometry.frame.width - known.width)
    for other in (None, replace(geometry, name="another")):
        assert door_from_message(closer(known), other).frame is None


@pytest.mark.parametrize(("changes", "words"), [
    ({"link_l3": 0.9}, ""), ({"friction": math.nan}, "friction"), ({"i_a_std": -0.1}, "i_a_std"),
    ({"covariance": (np.eye(4) - 0.6 * (np.ones((4, 4)) - np.eye(4))).ravel().tolist()},
     "covariance"),  # each pair is possible, all four are not
    ({"identified": ["i_a", "c_c", "k_c", "k_c"]}, "identified.*k_c"),
    ({"identified": ["i_a", "c_c", "k_c", "backcheck_angle"]}, "identified.*backcheck_angle")])
def test_parameters_that_are_no_door_are_refused_by_name(known, changes, words):
    with pytest.raises(errors.NoDoor, match=f"closer_parameters.*{words}"):
        door_from_message(closer(known, **changes))


def test_each_error_has_its_code():
    """Each error code of the service belongs to a class of errors."""
    codes = set()
    for kind in (*errors.PlannerError.__subclasses__(), *HumanoidMotionError.__subclasses__()):
        response = failure_response(PlanDoorImpact.Response(), kind("because"))
        assert not response.success
        assert response.message == "because"
        codes.add(response.error_code)
    assert codes == set(range(1, 7))
