"""Messages of walks: what users send is read exactly or refused with its value."""

import math

import pytest

pytest.importorskip("door_impact_msgs.msg")

from builtin_interfaces.msg import Time
from door_impact_msgs.action import Walk
from door_impact_msgs.msg import Footstep as FootstepMessage
from geometry_msgs.msg import PoseStamped, Quaternion, TransformStamped
from hypothesis import given
from hypothesis import strategies as st
from motion_execution.ros.walk_messages import (
    base_pose,
    footsteps_message,
    goal_from,
    pose_message,
)
from tf2_msgs.msg import TFMessage
from walking.errors import InvalidFootsteps
from walking.footsteps.footstep import Footstep, Pose, wrapped

PLACE = st.floats(-100.0, 100.0)
POSE = st.builds(Pose, PLACE, PLACE, st.floats(-3.1, 3.1))
STEP = st.builds(lambda side, pose, duration: Footstep(side, *pose, duration),
                 st.sampled_from(["left", "right"]), POSE, st.floats(0.3, 10.0))


@given(pose=POSE, keep=st.booleans(), duration=st.floats(0.3, 2.0))
def test_a_goal_is_read_as_it_was_sent(pose, keep, duration):
    message = Walk.Goal(goal=PoseStamped(pose=pose_message(pose)), keep_heading=keep,
                        step_duration=duration)
    goal = goal_from(message)
    assert goal.pose == pytest.approx(pose, abs=1e-12)
    assert (goal.footsteps, goal.keep_heading, goal.step_duration) == ((), keep, duration)


@given(steps=st.lists(STEP, min_size=1, max_size=4))
def test_footsteps_are_read_as_they_were_published(steps):
    message = footsteps_message(steps, Time(sec=3))
    assert message.header.frame_id == "odom"
    found = goal_from(Walk.Goal(footsteps=message.footsteps)).footsteps
    assert [(each.side, each.duration) for each in found] == [
        (each.side, each.duration) for each in steps]
    for one, other in zip(found, steps, strict=True):
        assert one.pose == pytest.approx(other.pose, abs=1e-12)


@given(step=STEP, pose=POSE)
def test_before_a_door_hinged_at_the_left_a_goal_is_its_mirror_image(step, pose):
    """In the mirror x = 0 the heading turns round and the other foot steps; twice it is itself."""
    message = Walk.Goal(goal=PoseStamped(pose=pose_message(pose)))
    found = goal_from(message, "left").pose
    assert (found.x, found.y) == pytest.approx((-pose.x, pose.y), abs=1e-9)
    assert wrapped(found.yaw - (math.pi - pose.yaw)) == pytest.approx(0.0, abs=1e-9)
    (seen,) = goal_from(
        Walk.Goal(footsteps=footsteps_message([step], Time()).footsteps), "left").footsteps
    assert {seen.side, step.side} == {"left", "right"}
    assert (seen.pose.x, seen.pose.y) == pytest.approx((-step.pose.x, step.pose.y), abs=1e-9)


@given(yaw=st.floats(-20.0, 20.0))
def test_headings_are_within_half_a_turn(yaw):
    turn = Quaternion(z=math.sin(0.5 * yaw), w=math.cos(0.5 * yaw))
    goal = Walk.Goal()
    goal.goal.pose.orientation = turn
    assert wrapped(goal_from(goal).pose.yaw - yaw) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("turn", "what"), [
    (Quaternion(x=0.2, w=0.98), "tilted"), (Quaternion(w=math.nan), "no number")])
def test_an_orientation_off_the_floor_is_refused_with_its_value(turn, what):
    goal = Walk.Goal()
    goal.goal.pose.orientation = turn
    with pytest.raises(InvalidFootsteps, match=what):
        goal_from(goal)
    with pytest.raises(InvalidFootsteps, match="footstep 1"):
        goal_from(Walk.Goal(footsteps=[FootstepMessage(side="left", pose=goal.goal.pose)]))


def test_the_base_is_found_among_the_transforms_and_is_a_number():
    other = TransformStamped(child_frame_id="RARM_LINK0")
    base = TransformStamped(child_frame_id="pelvis")
    base.header.frame_id = "odom"
    base.transform.translation.x = 2.0
    assert base_pose(TFMessage(transforms=[other]), "pelvis") is None
    base.header.stamp.sec = 3
    found = base_pose(TFMessage(transforms=[other, base]), "pelvis")
    assert found == (3.0, Pose(2.0, 0.0, 0.0))
    base.transform.translation.x = math.nan
    assert base_pose(TFMessage(transforms=[base]), "pelvis") is None
