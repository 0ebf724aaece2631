"""The node door_passer beside a driver that follows every trajectory, in simulated time.

Planner, executor and walker are played: the planner answers with one plan, and a hit or a walk
takes the robot at once to where it ends, a walk not exactly.
"""

import copy
import math
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("door_impact_msgs.msg")

import rclpy
from action_msgs.msg import GoalStatus
from door_impact_common.node import executor_of, spin_for
from door_impact_common.stamps import seconds, stamp_of
from door_impact_msgs.action import ExecuteDoorImpact, Walk, WalkThroughDoor
from door_impact_msgs.msg import HandCompliance, ImpactPlan, PlanPhase
from door_impact_msgs.srv import PlanDoorImpact, PlanDoorPassage
from door_model.door.config import load_door
from door_model.door.geometry import before
from geometry_msgs.msg import (
    Point,
    PoseWithCovarianceStamped,
    TransformStamped,
    WrenchStamped,
)
from humanoid_motion.kinematics import yaw_of
from humanoid_motion.knots import Knots
from humanoid_motion.leaf import LeafFrame
from humanoid_motion.mirror import sight
from motion_execution.ros.door_passer_node import DoorPasser
from motion_execution.ros.messages import floor_pose, pose_message
from motion_execution.ros.walker_node import Walker
from motion_execution.walk.reaching import Reaching
from rclpy.action import ActionClient, ActionServer, CancelResponse
from rclpy.node import Node
from rclpy.task import Future
from robot_driver.active_goals import ActiveGoals
from rosgraph_msgs.msg import Clock
from scipy.optimize import brentq
from sensor_msgs.msg import Imu, JointState
from tf2_msgs.msg import TFMessage
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from walking.footsteps.footstep import ORIGIN, Pose
from walking.passing.approach import hit_start
from walking.passing.felt import hand_place

TICK = 0.005  # period of the driver [s]
SURVEY = Pose(-0.4056, -0.715, 0.0)
OFF = Pose(0.012, -0.006, math.radians(0.6))  # of a walk's end from its goal
Result = WalkThroughDoor.Result


def hit_of(task: Any, names: list[str]) -> ImpactPlan:
    """A plan whose hit ends where a passage begins."""
    plan = ImpactPlan(plan_id="hit-1", door="paper", ending="pass", l_b=0.4, held_angle=task.angle)
    x, y = task.doorway.hinge
    plan.contact_point = Point(x=x + plan.l_b, y=y, z=1.0)
    for message, foot in ((plan.left_foot, task.stance.left), (plan.right_foot, task.stance.right)):
        message.position.x, message.position.y = foot.x, foot.y
    held = JointTrajectoryPoint(positions=task.joints.tolist())
    plan.phases = [PlanPhase(name="hold", trajectory=JointTrajectory(
        joint_names=names, points=[held]))]
    return plan


class Rig:
    """The passer, and a node that plays driver, encoder, odometry, planner, executor and user.

    Before a door hinged at the left, what it says and hears is the mirror image.
    """

    def __init__(self, robot: Any, task: Any, hinge: str) -> None:
        self.hinge, self.seen = hinge, sight(robot.config, hinge)
        self.robot, self.task, self.names = robot, task, list(robot.joint_names)
        self.plan = hit_of(task, self.names)
        self.node, self.other = DoorPasser(), Node("others")
        publisher = self.other.create_publisher
        self.clock = publisher(Clock, "/clock", 10)
        self.joints = publisher(JointState, "/joint_states", 50)
        self.imu, self.door = publisher(Imu, "/imu", 50), publisher(JointState, "/door_angle", 50)
        self.wrist = publisher(WrenchStamped, self.seen.text("/right_wrist/wrench"), 50)
        self.tf = publisher(TFMessage, "/tf", 50)
        self.other.create_subscription(JointTrajectory, "/joint_trajectory", self.follow, 10)
        self.compliance: list[Any] = []
        self.yielding = self.other.create_subscription(
            HandCompliance, "/hand_compliance", self.compliance.append, 10)
        self.other.create_service(PlanDoorImpact, "/plan_door_impact", self.on_plan)
        self.passages = ActiveGoals(self.other, "/walk_through_door")
        self.servers = [
            ActionServer(self.other, kind, name, done, cancel_callback=self.on_cancel)
            for kind, name, done in (
                (ExecuteDoorImpact, "/execute_door_impact", self.on_hit),
                (Walk, "/walk", self.on_walk))]
        self.told = publisher(PoseWithCovarianceStamped, "/door_pose", 1)
        self.client = ActionClient(self.other, WalkThroughDoor, "/walk_through_door")
        self.service = self.other.create_client(PlanDoorPassage, "/plan_door_passage")
        self.executor = executor_of(self.node)
        self.executor.add_node(self.other)
        self.position, self.angle, self.now = robot.config.half_sitting, 0.0, 1.0
        self.followed: tuple[float, Knots] | None = None
        self.requests: list[Any] = []  # of the planner
        self.hits: list[Any] = []  # goals of hits
        self.walks: list[Pose] = []  # goals of walks
        self.left = task.stance.left  # seen from the place
        self.place = ORIGIN  # middle between the soles before the hit, in odom
        self.walk_ends = Walk.Result.NONE
        self.wait: Future | None = None  # a hit or a walk lasts until this is done
        self.off: Callable[[float], float] = lambda _: 0.0  # of the leaf from its plan [rad]
        self.touches = 3.3  # time since its begin at which a reach meets the leaf [s]
        self.feedback: list[Any] = []

    def on_plan(self, request: Any, response: Any) -> Any:
        """Answer as the planner does."""
        self.requests.append(request)
        plan = copy.deepcopy(self.plan)
        if request.l_b > 0.0:
            plan.l_b, plan.contact_point.y = request.l_b, -request.door_distance
        response.success, response.plan = True, self.seen.message(plan)
        return response

    async def on_walk(self, handle: Any) -> Any:
        """Put the robot near the goal."""
        assert self.passages.asked_for(handle.goal_id)
        self.walks.append(Pose(*before(
            self.hinge, floor_pose(handle.request.goal.pose, "the goal"))))
        handle.publish_feedback(Walk.Feedback(zmp_margin=0.05))
        if self.wait is not None:
            await self.wait
        if self.walk_ends == Walk.Result.NONE and not handle.is_cancel_requested:
            self.place = self.walks[-1].moved(*OFF)
        handle.succeed()
        return Walk.Result(success=self.walk_ends == Walk.Result.NONE, error_code=self.walk_ends)

    def tell(self, door: Pose, std: float, age: float = 0.0) -> None:
        """Say on /door_pose where the door is, with a standard deviation of its place [m]."""
        message = PoseWithCovarianceStamped()
        message.header.stamp, message.header.frame_id = (
            stamp_of(round((self.now - age) * 1e9)), "odom")
        message.pose.pose = pose_message(Pose(*before(self.hinge, door)))
        message.pose.covariance[0] = message.pose.covariance[7] = std**2
        heard = self.node._walk_up._told
        self.until(lambda: self.told.get_subscription_count() > 0)
        self.told.publish(message)
        self.until(lambda: self.node._walk_up._told is not heard)

    async def on_hit(self, handle: Any) -> Any:
        """Put the robot where the hit ends, without the motion that leads there."""
        self.hits.append(handle.request)
        assert self.passages.asked_for(handle.goal_id)
        handle.publish_feedback(ExecuteDoorImpact.Feedback(phase="cam"))
        if self.wait is not None:
            await self.wait
        if handle.is_cancel_requested:
            handle.canceled()
            return ExecuteDoorImpact.Result(error_code=ExecuteDoorImpact.Result.STOPPED)
        self.position, self.angle = self.task.joints, self.task.angle
        handle.succeed()
        return ExecuteDoorImpact.Result(
            success=True, contact_sensor="feet", contact_time=self.now, peak_angle=0.44)

    def on_cancel(self, _: Any) -> Any:
        if self.wait is not None:
            self.wait.set_result(None)
        return CancelResponse.ACCEPT

    def follow(self, message: JointTrajectory) -> None:
        """Take a trajectory."""
        message = self.seen.message(message)
        rows = ([getattr(point, field) for point in message.points]
                for field in ("positions", "velocities", "accelerations"))
        times = np.array([seconds(point.time_from_start) for point in message.points])
        self.followed = seconds(message.header.stamp), Knots(times, *map(np.array, rows))

    def until(self, done: Callable[[], Any]) -> None:
        """Spin until a condition holds, while the driver ticks."""
        limit = time.monotonic() + 60.0
        while not done():
            assert time.monotonic() < limit, "nothing happened"
            self.tick()

    def tick(self) -> None:
        """Publish the messages of a tick, and let the nodes handle them."""
        self.now += TICK
        stamp = stamp_of(round(self.now * 1e9))
        if self.followed is not None:
            begin, knots = self.followed
            self.position = knots.at(min(max(self.now - begin, 0.0), knots.time[-1]))[0][0]
        passage, force = self.node._passage, 12.0
        if isinstance(passage, Reaching):
            force *= passage.since(self.now) > self.touches
        elif passage is not None:
            since = max(passage.since(self.now), 0.0)
            self.angle = float(passage.passage.push.at(np.array([since]))[0]) + self.off(since)
        self.clock.publish(Clock(clock=stamp))
        joints = JointState(name=self.names, position=self.position.tolist(),
                            velocity=[0.0] * len(self.names))
        door = JointState(name=["door_hinge"], position=[self.angle], velocity=[0.0])
        imu, wrist = Imu(), WrenchStamped()
        imu.orientation.w, imu.linear_acceleration.z, wrist.wrench.force.y = 1.0, 9.81, force
        for publisher, message in ((self.joints, joints), (self.imu, imu), (self.door, door),
                                   (self.wrist, wrist)):
            message.header.stamp = stamp
            publisher.publish(self.seen.message(message))
        self.tf.publish(TFMessage(transforms=[self.base(stamp)]))
        spin_for(self.executor, 0.002)

    def base(self, stamp: Any) -> TransformStamped:
        """The odometry, which holds the left sole where the robot stands on it."""
        sole, = self.robot.poses_in_base(self.position, [self.robot.feet["left"].frame])
        foot = Pose(float(sole[0, 3]), float(sole[1, 3]), yaw_of(sole))
        message = TransformStamped(child_frame_id="base_link")
        message.header.stamp, message.header.frame_id = stamp, "odom"
        place, turn = message.transform.translation, message.transform.rotation
        base = self.place.moved(*self.left).moved(*ORIGIN.seen_from(foot))
        place.x, place.y, heading = before(self.hinge, base)
        turn.z, turn.w = math.sin(0.5 * heading), math.cos(0.5 * heading)
        return message

    def send(self, **fields: Any) -> Any:
        """Send a goal, and return its handle."""
        self.until(self.client.server_is_ready)
        sent = self.client.send_goal_async(
            WalkThroughDoor.Goal(**fields),
            feedback_callback=lambda m: self.feedback.append(m.feedback))
        self.until(sent.done)
        return sent.result()

    def end(self, handle: Any) -> Any:
        """Wait for the result of a goal."""
        result = handle.get_result_async()
        self.until(result.done)
        return result.result()

    def phase(self, name: str) -> None:
        """Wait for a phase."""
        self.until(lambda: self.feedback and self.feedback[-1].phase == name)

    def ask(self, **fields: Any) -> Any:
        """Call the service."""
        self.until(self.service.service_is_ready)
        future = self.service.call_async(PlanDoorPassage.Request(**fields))
        self.until(future.done)
        return future.result()


@pytest.fixture
def rig(request, robot, task, tmp_path) -> Iterator[Rig]:
    (name, hinge), door = getattr(request, "param", ("paper", "right")), tmp_path / "door.yaml"
    door.write_text(replace(load_door(name), hinge=hinge).to_yaml())
    words = [word for value in ("use_sim_time:=true", f"door:={door}", "hand_stiffness:=400.0",
                                "door_distance:=0.715", "hinge_x:=-0.4056")
             for word in ("-p", value)]
    rclpy.init(args=["--ros-args", *words], domain_id=100 + os.getpid() % 50)
    made = Rig(robot, task, hinge)
    try:
        yield made
    finally:
        made.executor.shutdown()
        for server in made.servers:
            server.destroy()  # its states would be latched beyond the context
        made.node.destroy_node()
        made.other.destroy_node()
        rclpy.shutdown()


@pytest.mark.parametrize("rig", [("paper", "right"), ("paper", "left")], indirect=True)
def test_hit_and_passage_follow_each_other(rig):
    """The hand yields from the passage's begin to the release, and the result says what was."""
    handle = rig.send(probe=1, speed_scale=0.5)
    assert not rig.send().accepted  # while the first one is under way
    found = rig.end(handle)
    answer = found.result
    assert found.status == GoalStatus.STATUS_SUCCEEDED, answer.message
    assert (answer.success, answer.error_code) == (True, Result.NONE)
    ((goal,), (request,)) = rig.hits, rig.requests
    assert (goal.plan_id, goal.probe, goal.speed_scale, goal.dry_run) == ("hit-1", 1, 0.5, False)
    assert (request.ending, request.desired_opening_angle) == (
        "pass", pytest.approx(math.radians(25.0)))
    assert list(dict.fromkeys(each.phase for each in rig.feedback)) == [
        "plan", "hit", "push", "walk", "square_up"]
    assert answer.steps == len(answer.plan.footsteps)
    assert answer.time_to_clear + TICK > answer.hit_to_clear > answer.plan.clear_time
    assert answer.start_time + answer.plan.clear_time == pytest.approx(
        answer.contact_time + answer.hit_to_clear)
    assert answer.peak_angle == pytest.approx(0.44)
    assert answer.largest_hand_force == pytest.approx(12.0)
    assert answer.largest_leaf_error < math.radians(1.0)
    assert answer.release_angle == pytest.approx(max(answer.plan.leaf_angle), abs=0.02)
    assert [each.step for each in rig.feedback] == sorted(each.step for each in rig.feedback)
    assert [(each.side, each.stiffness) for each in rig.compliance] == [
        (rig.hinge, 400.0), (rig.hinge, -1.0)]
    last = answer.plan.footsteps[-1].pose
    assert last.position.y < rig.task.doorway.far_face
    assert 2.0 * math.acos(abs(last.orientation.w)) == pytest.approx(
        before(rig.hinge, (0.0, 0.0, 0.0))[2], abs=math.radians(60.0))


def test_nothing_moves_where_the_door_cannot_be_passed(rig):
    """No other hit widens an opening; where it would leave the robot elsewhere, it is tried."""
    answer = rig.end(rig.send(leaf_angle=math.radians(30.0))).result
    assert answer.error_code == Result.PASSAGE_INFEASIBLE
    assert "between the leaf at 30 deg and the jamb" in answer.message
    assert len(rig.requests) == 1
    rig.requests.clear()
    rig.plan.held_angle += math.radians(8.0)  # where the hand would not be
    answer = rig.end(rig.send()).result
    assert answer.error_code == Result.PASSAGE_INFEASIBLE
    assert [(round(math.degrees(each.desired_opening_angle)), each.ending)
            for each in rig.requests[:3]] == [(25, "pass"), (30, "pass"), (35, "pass")]
    assert rig.end(rig.send(hit_angle=math.nan)).result.error_code == Result.INVALID_GOAL
    assert rig.end(rig.send(opening="kick")).result.error_code == Result.INVALID_GOAL
    rig.other.destroy_subscription(rig.yielding)
    answer = rig.end(rig.send()).result
    assert (answer.error_code, "hand_stiffness" in answer.message) == (Result.NOT_READY, True)
    assert (rig.hits, rig.followed) == ([], None)


def test_a_cancel_ends_the_hit_and_in_the_passage_finishes_the_step(rig):
    rig.wait = Future()
    handle = rig.send()
    rig.phase("hit")
    handle.cancel_goal_async()
    found = rig.end(handle)
    assert (found.status, found.result.error_code, rig.followed) == (
        GoalStatus.STATUS_CANCELED, Result.STOPPED, None)
    rig.wait = None
    handle = rig.send()
    rig.phase("push")
    step = rig.feedback[-1].step
    rig.passages.cancel()  # as the executor does at /stop
    found = rig.end(handle)
    assert (found.status, found.result.error_code) == (
        GoalStatus.STATUS_CANCELED, Result.STOPPED)
    assert step - 1 <= found.result.steps <= step + 1
    assert math.isnan(found.result.hit_to_clear)
    assert rig.now > rig.followed[0] + rig.followed[1].time[-1]
    assert rig.compliance[-1].stiffness == -1.0


def test_a_passage_that_was_stopped_goes_on_from_the_held_leaf(rig):
    """Without another hit; a hand that does not hold the leaf is refused."""
    handle = rig.send()
    rig.phase("walk")
    handle.cancel_goal_async()
    assert rig.end(handle).result.error_code == Result.STOPPED
    hold = rig.node._left.hold
    rig.left = hold.stance.left
    place = hand_place(rig.robot, hold.joints, replace(rig.task, stance=hold.stance))
    rig.angle += 0.5
    assert "does not hold the leaf" in rig.end(rig.send()).result.message
    rig.angle = brentq(lambda angle: LeafFrame(rig.task.doorway.hinge, angle).gap(place)
                       - rig.robot.hand_radius, rig.angle - 1.0, rig.angle)
    assert rig.ask().plan.opening == ""
    found = rig.end(rig.send()).result
    assert found.success, found.message
    assert len(rig.hits) == 1
    assert found.plan.footsteps[-1].pose.position.y < rig.task.doorway.far_face


def test_the_service_plans_from_the_end_of_a_hit(rig):
    answer = rig.ask(hit_angle=0.4, run_up="mcv50")
    assert answer.success, answer.message
    assert (rig.requests[0].desired_opening_angle, rig.requests[0].run_up) == (0.4, "mcv50")
    count = len(answer.plan.times)
    assert count == pytest.approx(20.0 * answer.plan.duration, abs=1.5)
    assert {len(values) for values in (answer.plan.leaf_angle, answer.plan.hand_force,
                                       answer.plan.hand_radius)} == {count}
    assert answer.plan.zmp_margin > 0.01


@pytest.mark.parametrize("rig", [("paper", "left")], indirect=True)
def test_a_robot_elsewhere_walks_up_and_passes_from_where_it_really_stands(rig):
    """Hit and passage are planned anew there; the door is where it is in odom."""
    rig.place = Pose(-1.2, 1.6, 0.5)
    found = rig.end(rig.send(probe=ExecuteDoorImpact.Goal.OFF)).result
    assert found.success, found.message
    assert list(dict.fromkeys(each.phase for each in rig.feedback)) == [
        "plan", "approach", "hit", "push", "walk", "square_up"]
    assert rig.walks == [pytest.approx(ORIGIN)]
    first, seen = rig.requests
    assert (first.door_distance, first.l_b) == (-1.0, -1.0)
    b = rig.place.moved(rig.plan.contact_point.x, -seen.door_distance)
    assert b[:2] == pytest.approx((SURVEY.x + seen.l_b, SURVEY.y), abs=1e-3)
    assert [goal.probe for goal in rig.hits] == [ExecuteDoorImpact.Goal.OFF]
    assert found.plan.footsteps[-1].pose.position.y < rig.task.doorway.far_face
    assert all(each.clearance > 0.0 for each in rig.feedback if each.phase == "walk")


def test_the_walker_lets_the_walk_of_a_passage_through(rig):
    """It refuses others' while a passage runs; a dry run has it plan the way."""
    rig.servers.pop().destroy()
    walker = Walker()
    rig.executor.add_node(walker)
    try:
        rig.place = Pose(-0.3, 0.4, 0.2)
        found = rig.end(rig.send(dry_run=True)).result
        assert found.success, found.message
    finally:
        walker.destroy_node()


def test_a_door_that_is_told_of_is_touched_and_passed_where_it_is(rig):
    door = Pose(3.0, 1.0, 2.0)
    start = hit_start(door, SURVEY)
    rig.place = start.moved(0.004, 0.0)  # nobody walks so far
    rig.tell(door, 0.01)
    found = rig.end(rig.send(dry_run=True)).result
    assert found.success, found.message
    assert [goal.probe for goal in rig.hits] == [ExecuteDoorImpact.Goal.ON]
    assert rig.walks == []
    assert rig.requests[-1].l_b == pytest.approx(rig.plan.contact_point.x - SURVEY.x + 0.004)
    last = floor_pose(found.plan.footsteps[-1].pose, "the last footstep")
    assert last.seen_from(start).y < rig.task.doorway.far_face


def test_without_a_way_to_the_door_nothing_moves(rig):
    """And no hit follows a walk that has not arrived, or was cancelled."""
    rig.place = Pose(-1.2, 1.6, 0.5)
    assert rig.end(rig.send(walk_up=False)).result.error_code == Result.NOT_REACHED
    for ends, wanted in ((Walk.Result.INFEASIBLE, Result.NOT_REACHED),
                         (Walk.Result.FELL, Result.FELL)):
        rig.walk_ends = ends
        assert rig.end(rig.send()).result.error_code == wanted
    rig.walk_ends, rig.wait = Walk.Result.NONE, Future()
    handle = rig.send()
    rig.until(lambda: len(rig.walks) == 3)
    handle.cancel_goal_async()
    found = rig.end(handle)
    assert (found.status, found.result.error_code) == (
        GoalStatus.STATUS_CANCELED, Result.STOPPED)
    for y, std, age in ((-1.0, 0.02, 0.0), (-1.0, 0.0, 6.0), (3.0, 0.0, 0.0)):
        rig.tell(Pose(0.0, y, 0.0), std, age)
        assert rig.end(rig.send()).result.error_code == Result.BAD_DOOR_POSE
    assert (rig.hits, rig.followed, len(rig.walks)) == ([], None, 3)


def test_a_heavy_door_is_pushed_only_if_somebody_wants_it(rig):
    """The plan says how the leaf is opened, and why."""
    for wanted, way, reason in (("", "hit", "22 N are allowed"), ("push", "push", "100 N")):
        plan = rig.ask(opening=wanted).plan
        assert plan.opening == way
        assert reason in plan.opening_reason


@pytest.mark.parametrize("rig", [("light", "left")], indirect=True)
def test_a_light_door_is_pushed_from_closed(rig):
    """Nobody hits it; the passage begins where the hand has met the leaf, with the leaf closed."""
    rig.end(rig.send(dry_run=True))
    assert rig.followed is None
    answer = rig.end(rig.send()).result
    assert answer.success, answer.message
    assert rig.hits == rig.requests == []
    assert [each for each in dict.fromkeys(each.phase for each in rig.feedback) if each != "plan"] \
        == ["reach", "push", "walk", "square_up"]
    assert (answer.plan.opening, answer.plan.leaf_angle[0]) == ("push", 0.0)
    assert "22 N are allowed" in answer.plan.opening_reason
    assert math.isnan(answer.hit_to_clear)
    assert math.isnan(answer.contact_time)
    assert answer.time_to_clear > answer.plan.clear_time + rig.touches
    assert [each.stiffness for each in rig.compliance] == [400.0, -1.0]


@pytest.mark.parametrize("rig", [("light", "right")], indirect=True)
def test_a_hand_that_does_not_meet_the_leaf_or_is_stopped_before_stands(rig):
    """The hand has not gone on when it was stopped."""
    rig.touches = math.inf
    answer = rig.end(rig.send()).result
    assert answer.error_code == Result.NO_CONTACT, answer.message
    way = rig.followed[1].time[-1]
    rig.position, rig.followed, rig.feedback = rig.robot.config.half_sitting, None, []
    handle = rig.send()
    rig.phase("reach")
    handle.cancel_goal_async()
    found = rig.end(handle)
    assert (found.status, found.result.error_code) == (
        GoalStatus.STATUS_CANCELED, Result.STOPPED), found.result.message
    assert rig.followed[1].time[-1] < way
    assert "push" not in {each.phase for each in rig.feedback}
