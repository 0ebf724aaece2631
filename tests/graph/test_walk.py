"""The action /walk in the running graph: goals, footsteps, cancel, stop, newer goals, bad input."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from action_msgs.msg import GoalStatus
from door_impact_msgs.action import ExecuteDoorImpact, Walk
from door_impact_msgs.msg import Footstep, Footsteps
from geometry_msgs.msg import Point, PointStamped, Pose, PoseStamped, Quaternion, WrenchStamped
from rclpy.action import ActionClient
from sensor_msgs.msg import Imu, JointState
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

Result = Walk.Result
STILL = 6e-3  # [rad]: noise of the sensors makes the stabilizer move an ankle by up to 4.8 mrad
MOST_TILT = math.radians(5.0)


def pose(x: float, y: float, yaw: float = 0.0) -> Pose:
    return Pose(position=Point(x=x, y=y),
                orientation=Quaternion(z=math.sin(0.5 * yaw), w=math.cos(0.5 * yaw)))


def to(x: float, y: float = 0.0, yaw: float = 0.0, **fields: Any) -> Walk.Goal:
    return Walk.Goal(goal=PoseStamped(pose=pose(x, y, yaw)), **fields)


class Sent:
    """A goal that was accepted; `feedback` is what has arrived of it."""

    def __init__(self, graph: Any, client: ActionClient, goal: Walk.Goal) -> None:
        self.graph, self.feedback = graph, list[Any]()
        future = client.send_goal_async(
            goal, feedback_callback=lambda message: self.feedback.append(message.feedback))
        self.handle = graph.result(future, "the goal")
        assert self.handle.accepted
        self.future = self.handle.get_result_async()

    def until_step(self, step: int) -> None:
        self.graph.spin_until(
            lambda: self.future.done() or (self.feedback and self.feedback[-1].step >= step),
            f"step {step}")
        assert not self.future.done(), self.future.result().result.message

    @property
    def end(self) -> Any:
        return self.graph.result(self.future, "the result")


@contextmanager
def walker(graph: Any) -> Iterator[Callable[[Walk.Goal], Sent]]:
    client = ActionClient(graph.node, Walk, "/walk")
    try:
        graph.spin_until(client.server_is_ready, "the action")
        yield lambda goal: Sent(graph, client, goal)
    finally:
        client.destroy()


@pytest.fixture
def walk(graph: Any) -> Iterator[Callable[[Walk.Goal], Sent]]:
    """Sends goals to a robot that stands at its first place."""
    assert graph.call(Trigger, "/sim/reset").success
    graph.last(PointStamped, "/zmp")
    with walker(graph) as send:
        yield send


def stands(graph: Any) -> None:
    """Assert that the robot is upright at rest, with both feet loaded."""
    speed = np.abs(graph.last(JointState, "/joint_states").velocity).max()
    assert speed < 0.3
    q = graph.last(Imu, "/imu").orientation
    assert math.acos(1.0 - 2.0 * (q.x**2 + q.y**2)) < MOST_TILT
    for side in ("left", "right"):
        assert graph.last(WrenchStamped, f"/{side}_foot/wrench").wrench.force.z > 100.0


def at(result: Any) -> tuple[float, float, float]:
    place, turn = result.pose.pose.position, result.pose.pose.orientation
    return place.x, place.y, 2.0 * math.atan2(turn.z, turn.w)


def test_a_walk_to_a_pose(graph: Any, walk: Callable[[Walk.Goal], Sent]) -> None:
    """It arrives within 20 mm by the odometry; footsteps, markers and feedback tell of it."""
    sent = walk(to(0.4, 0.1, 0.3))
    sent.until_step(1)
    steps = graph.last(Footsteps, "/footsteps", latched=True)
    markers = graph.last(MarkerArray, "/footstep_markers", latched=True)
    assert len(markers.markers) == 1 + len(steps.footsteps)
    found = sent.end
    assert found.status == GoalStatus.STATUS_SUCCEEDED, found.result.message
    assert found.result.success
    assert at(found.result) == pytest.approx((0.4, 0.1, 0.3), abs=0.02)
    assert found.result.steps == len(steps.footsteps) == sent.feedback[-1].steps
    assert steps.header.frame_id == "odom"
    number = {each.step for each in sent.feedback}
    assert number == set(range(1, found.result.steps + 1)) | ({0} & number)
    margins = [each.zmp_margin for each in sent.feedback if not math.isnan(each.zmp_margin)]
    assert len(margins) > 0.5 * len(sent.feedback)
    stands(graph)


def test_a_walk_over_footsteps_of_the_user(
        graph: Any, walk: Callable[[Walk.Goal], Sent]) -> None:
    """Two footsteps beside each other, 0.1 m behind where the robot stands; a dry run before."""
    steps = [Footstep(side=side, duration=0.9, pose=pose(-0.1, y))
             for side, y in (("left", 0.095), ("right", -0.095))]
    before = np.array(graph.last(JointState, "/joint_states").position)
    assert walk(Walk.Goal(footsteps=steps, dry_run=True)).end.result.success
    after = np.array(graph.last(JointState, "/joint_states").position)
    assert np.abs(after - before).max() < STILL
    found = walk(Walk.Goal(footsteps=steps)).end
    assert found.result.success, found.result.message
    assert found.result.steps == 2
    assert at(found.result) == pytest.approx((-0.1, 0.0, 0.0), abs=0.015)


def test_a_cancel_finishes_the_step_and_no_hit_begins_while_the_robot_walks(
        graph: Any, walk: Callable[[Walk.Goal], Sent]) -> None:
    sent = walk(to(3.0))
    sent.until_step(1)
    client = ActionClient(graph.node, ExecuteDoorImpact, "/execute_door_impact")
    try:
        graph.spin_until(client.server_is_ready, "the action")
        handle = graph.result(client.send_goal_async(ExecuteDoorImpact.Goal()), "the goal")
        hit = graph.result(handle.get_result_async(), "the result").result
    finally:
        client.destroy()
    assert hit.error_code == ExecuteDoorImpact.Result.NOT_READY
    assert "walks" in hit.message
    step = sent.feedback[-1].step
    graph.result(sent.handle.cancel_goal_async(), "the cancel")
    found = sent.end
    assert found.status == GoalStatus.STATUS_CANCELED
    assert found.result.error_code == Result.STOPPED
    assert step <= found.result.steps <= step + 3
    stands(graph)


def test_a_newer_goal_replaces_the_footsteps_that_have_not_begun_and_a_stop_ends_it(
        graph: Any, walk: Callable[[Walk.Goal], Sent]) -> None:
    """The robot never stands still in between."""
    first = walk(to(4.0))
    first.until_step(2)
    x = first.feedback[-1].pose.pose.position.x
    second = walk(to(x + 0.9, 0.4, 0.2))
    older = first.end
    assert older.status == GoalStatus.STATUS_ABORTED
    assert older.result.error_code == Result.REPLACED
    second.until_step(3)
    assert second.feedback[0].step >= 2
    answer = graph.call(Trigger, "/stop")
    assert answer.success
    assert "walk" in answer.message
    assert second.end.result.error_code == Result.STOPPED
    stands(graph)


def test_a_bad_goal_is_a_code_and_a_sentence_and_nothing_moves(
        graph: Any, walk: Callable[[Walk.Goal], Sent]) -> None:
    """A goal that lies, a footstep out of reach, and steps that are too short."""
    lying = Pose(orientation=Quaternion(x=0.7, y=0.0, z=0.0, w=0.714))
    far = Footstep(side="left", pose=pose(100.0, 0.0))
    before = np.array(graph.last(JointState, "/joint_states").position)
    for bad in (Walk.Goal(goal=PoseStamped(pose=lying)), Walk.Goal(footsteps=[far]),
                to(0.5, step_duration=0.05)):
        found = walk(bad).end
        assert found.status == GoalStatus.STATUS_ABORTED
        assert found.result.error_code == Result.INVALID_GOAL, found.result.message
        assert len(found.result.message.split()) > 3
    after = np.array(graph.last(JointState, "/joint_states").position)
    assert np.abs(after - before).max() < STILL
