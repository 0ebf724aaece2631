"""The action /walk in the running graph: goals, footsteps, cancel, stop, newer goals, bad input."""

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from action_msgs.msg import GoalStatus
from door_impact_msgs.action import ExecuteDoorImpact, Walk
from door_impact_msgs.msg import Footstep, Footsteps
from geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion, WrenchStamped
from rclpy.action import ActionClient
from rosgraph_msgs.msg import Clock
from running_graph import seconds
from sensor_msgs.msg import Imu, JointState
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import MarkerArray

Result = Walk.Result
STILL = 6e-3  # [rad]: noise of the sensors makes the stabilizer move an ankle by up to 4.8 mrad
PAUSE = 7.0  # longer than a driver may be silent (silent_after) [s]
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

    def reaches(self, step: int) -> bool:
        """Whether a step begins before the walk ends."""
        self.graph.spin_until(
            lambda: self.future.done() or (self.feedback and self.feedback[-1].step >= step),
            f"step {step}")
        return not self.future.done()

    @property
    def end(self) -> Any:
        return self.graph.result(self.future, "the result")


class Walker:
    """The action /walk."""

    def __init__(self, graph: Any) -> None:
        self.graph, self.client = graph, ActionClient(graph.node, Walk, "/walk")
        graph.spin_until(self.client.server_is_ready, "the action")

    def send(self, goal: Walk.Goal) -> Sent:
        return Sent(self.graph, self.client, goal)

    def arrive(self, goal: Walk.Goal) -> Sent:
        sent = self.send(goal)
        assert sent.end.result.success, sent.end.result.message
        return sent

    def begin(self, goal: Walk.Goal, step: int) -> Sent:
        sent = self.send(goal)
        assert sent.reaches(step), sent.end.result.message
        return sent


@contextmanager
def walker(graph: Any) -> Iterator[Walker]:
    walk = Walker(graph)
    try:
        yield walk
    finally:
        walk.client.destroy()


@pytest.fixture
def walk(graph: Any) -> Iterator[Walker]:
    """Sends goals to a robot that stands at its first place."""
    graph.reset()
    with walker(graph) as walk:
        yield walk


def stands(graph: Any) -> None:
    """Assert that the robot comes to rest upright, with both feet loaded."""
    graph.listen(JointState, "/joint_states", lambda got: len(got) > 200 and all(
        np.abs(m.velocity).max() < 0.3 for m in got[-200:]))
    q = graph.last(Imu, "/imu").orientation
    assert math.acos(1.0 - 2.0 * (q.x**2 + q.y**2)) < MOST_TILT
    for side in ("left", "right"):
        assert graph.last(WrenchStamped, f"/{side}_foot/wrench").wrench.force.z > 100.0


def at(pose: Any) -> tuple[float, float, float]:
    place, turn = pose.position, pose.orientation
    return place.x, place.y, 2.0 * math.atan2(turn.z, turn.w)


def test_a_walk_arrives_at_its_pose_over_the_footsteps_that_it_shows(
        graph: Any, walk: Walker) -> None:
    """Within 20 mm by the odometry; a pause of the simulation in a step is no fault."""
    sent = walk.begin(to(0.4, 0.1, 0.3), 2)
    assert not graph.call(Trigger, "/sim/step").success
    graph.call(SetBool, "/sim/pause", data=True)
    clock: list[Any] = []
    heard = graph.node.create_subscription(Clock, "/clock", clock.append, 10)
    time.sleep(PAUSE)
    for _ in range(2):
        graph.call(Trigger, "/sim/step")
    graph.spin_until(lambda: len(clock) > 1, "two steps")
    graph.node.destroy_subscription(heard)
    assert seconds(clock[1].clock) - seconds(clock[0].clock) == pytest.approx(0.005)
    graph.call(SetBool, "/sim/pause", data=False)
    assert sent.end.result.success, sent.end.result.message
    found = sent.end.result
    assert at(found.pose.pose) == pytest.approx((0.4, 0.1, 0.3), abs=0.02)
    assert {each.step for each in sent.feedback} <= set(range(found.steps + 1))
    assert not all(math.isnan(each.zmp_margin) for each in sent.feedback)
    steps = graph.last(Footsteps, "/footsteps", latched=True)
    assert steps.header.frame_id == "odom"
    last = np.mean([at(each.pose) for each in steps.footsteps[-2:]], axis=0)
    assert last == pytest.approx((0.4, 0.1, 0.3), abs=1e-6)
    markers = graph.last(MarkerArray, "/footstep_markers", latched=True)
    assert len(markers.markers) == 1 + len(steps.footsteps)
    stands(graph)


def test_a_walk_makes_the_footsteps_of_its_goal_and_a_dry_run_moves_nothing(
        graph: Any, walk: Walker) -> None:
    """Two footsteps beside each other, 0.1 m back; a motion server that is held up is no harm."""
    steps = [Footstep(side=side, duration=0.9, pose=pose(-0.1, y))
             for side, y in (("left", 0.095), ("right", -0.095))]
    before = np.array(graph.last(JointState, "/joint_states").position)
    walk.arrive(Walk.Goal(footsteps=steps, dry_run=True))
    after = np.array(graph.last(JointState, "/joint_states").position)
    assert np.abs(after - before).max() < STILL
    sent = walk.send(Walk.Goal(footsteps=steps))
    while not sent.future.done():
        with graph.frozen("motion_server"):
            time.sleep(0.3)
        graph.listen(JointState, "/joint_states", lambda got: len(got) > 30)
    found = sent.end.result
    assert found.success, found.message
    assert found.steps == 2
    assert at(found.pose.pose) == pytest.approx((-0.1, 0.0, 0.0), abs=0.015)


def test_a_cancel_finishes_the_step_and_no_hit_begins_while_the_robot_walks(
        graph: Any, walk: Walker) -> None:
    client = ActionClient(graph.node, ExecuteDoorImpact, "/execute_door_impact")
    try:
        graph.spin_until(client.server_is_ready, "the action")
        sent = walk.begin(to(3.0), 2)
        handle = graph.result(client.send_goal_async(ExecuteDoorImpact.Goal()), "the goal")
        hit = graph.result(handle.get_result_async(), "the result").result
    finally:
        client.destroy()
    assert not hit.success
    assert "walks" in hit.message
    step = sent.feedback[-1].step
    graph.result(sent.handle.cancel_goal_async(), "the cancel")
    found = sent.end
    assert found.status == GoalStatus.STATUS_CANCELED
    assert found.result.error_code == Result.STOPPED, found.result.message
    assert step - 1 <= found.result.steps < sent.feedback[-1].steps
    stands(graph)


def test_a_newer_goal_replaces_the_footsteps_that_have_not_begun_and_a_stop_ends_it(
        graph: Any, walk: Walker) -> None:
    """The steps are counted on."""
    graph.client(Trigger, "/stop")
    first = walk.begin(to(4.0), 2)
    x = first.feedback[-1].pose.pose.position.x
    second = walk.send(to(x + 0.9, 0.4, 0.2))
    older = first.end
    assert second.reaches(3), second.end.result.message
    answer = graph.call(Trigger, "/stop")
    assert answer.success
    assert "walk" in answer.message
    newer = second.end.result
    assert older.status == GoalStatus.STATUS_ABORTED
    assert older.result.error_code == Result.REPLACED, older.result.message
    assert second.feedback[0].step >= 2
    assert newer.error_code == Result.STOPPED, newer.message
    stands(graph)


def test_a_bad_goal_is_a_code_and_a_sentence_and_nothing_moves(graph: Any, walk: Walker) -> None:
    """A goal that lies, a footstep out of reach, and steps that are too short."""
    lying = Pose(orientation=Quaternion(x=0.7, y=0.0, z=0.0, w=0.714))
    far = Footstep(side="left", pose=pose(100.0, 0.0))
    before = np.array(graph.last(JointState, "/joint_states").position)
    for bad in (Walk.Goal(goal=PoseStamped(pose=lying)), Walk.Goal(footsteps=[far]),
                to(0.5, step_duration=0.05)):
        found = walk.send(bad).end
        assert found.result.error_code == Result.INVALID_GOAL, found.result.message
        assert found.status == GoalStatus.STATUS_ABORTED
        assert len(found.result.message.split()) > 3
    after = np.array(graph.last(JointState, "/joint_states").position)
    assert np.abs(after - before).max() < STILL
