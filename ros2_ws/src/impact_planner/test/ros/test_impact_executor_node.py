"""The node impact_executor beside a driver that follows every trajectory, in simulated time."""

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import rclpy
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from door_impact_common.node import executor_of, spin_for
from door_impact_common.stamps import stamp_of
from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_msgs.msg import ImpactPlan
from humanoid_motion.knots import Knots
from impact_planner.ros.impact_executor_node import ImpactExecutor
from impact_planner.ros.messages import knots_from_message, plan_message
from rclpy.action import ActionClient
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from trajectory_msgs.msg import JointTrajectory

TICK = 0.005  # period of the driver [s]
Result = ExecuteDoorImpact.Result


class Driver:
    """The executor, and a node that plays driver, encoder, clock, planner and user."""

    def __init__(self, robot: Any, plan: Any) -> None:
        self.node = ImpactExecutor()
        self.other = rclpy.create_node("driver")
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.clock = self.other.create_publisher(Clock, "/clock", 10)
        self.joints = self.other.create_publisher(JointState, "/joint_states", 50)
        self.imu = self.other.create_publisher(Imu, "/imu", 50)
        self.door = self.other.create_publisher(JointState, "/door_angle", 50)
        self.plans = self.other.create_publisher(ImpactPlan, "/door_impact_plan", latched)
        self.status: list[Any] = []
        self.other.create_subscription(
            DiagnosticArray, "/diagnostics", lambda m: self.status.extend(m.status), 10)
        self.other.create_subscription(JointTrajectory, "/joint_trajectory", self.follow, 10)
        self.client = ActionClient(self.other, ExecuteDoorImpact, "/execute_door_impact")
        self.names = list(robot.joint_names)
        self.position = plan.phase("prepare").knots.position[0]
        self.followed: tuple[float, Knots] | None = None
        self.stops = 0
        self.now = 1.0
        self.executor = executor_of(self.node)
        self.executor.add_node(self.other)
        self.plans.publish(plan_message(plan, robot.joint_names, Time(), trajectories=True))
        self.feedback: list[str] = []

    def follow(self, message: JointTrajectory) -> None:
        """Take a trajectory."""
        self.stops += not message.points
        stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
        self.followed = (stamp, knots_from_message(message, self.names)) if message.points else None

    def until(self, done: Callable[[], Any], tick: bool = True) -> None:
        """Spin until a condition holds, while the driver ticks or stands still."""
        limit = time.monotonic() + 120.0
        while not done():
            assert time.monotonic() < limit, "nothing happened"
            if tick:
                self.tick()
            self.executor.spin_once(timeout_sec=0.005)

    def tick(self) -> None:
        """Publish the messages of a tick, and let the executor handle them."""
        self.now += TICK
        stamp = stamp_of(round(self.now * 1e9))
        if self.followed is not None:
            at = min(max(self.now - self.followed[0], 0.0), self.followed[1].time[-1])
            self.position = self.followed[1].at(at)[0][0]
        self.clock.publish(Clock(clock=stamp))
        joints = JointState(name=self.names, position=self.position.tolist(),
                            velocity=[0.0] * len(self.names))
        door = JointState(name=["door"], position=[0.0], velocity=[0.0])
        imu = Imu()
        imu.orientation.w = 1.0
        for publisher, message in ((self.joints, joints), (self.imu, imu), (self.door, door)):
            message.header.stamp = stamp
            publisher.publish(message)
        spin_for(self.executor, 0.0)

    def goal(self, **fields: Any) -> Any:
        """Send a goal, and return the future of its result when it was accepted."""
        self.until(lambda: self.client.server_is_ready()
                   and self.node.count_publishers("/door_impact_plan"))
        for _ in range(20):
            self.tick()
        sent = self.client.send_goal_async(
            ExecuteDoorImpact.Goal(speed_scale=1.0, **fields),
            feedback_callback=lambda m: self.feedback.append(m.feedback.phase))
        self.until(sent.done)
        assert sent.result().accepted
        return sent.result().get_result_async()


@contextmanager
def running(robot: Any, plan: Any, **parameters: Any) -> Iterator[Driver]:
    """A driver on a domain of its own; the executor has these parameters."""
    words = [word for name, value in {"use_sim_time": "true", **parameters}.items()
             for word in ("-p", f"{name}:={value}")]
    rclpy.init(args=["--ros-args", *words])
    driver = Driver(robot, plan)
    try:
        yield driver
    finally:
        driver.executor.shutdown()
        driver.node.destroy_node()
        driver.other.destroy_node()
        rclpy.shutdown()


def test_a_dead_simulation_ends_the_motion_although_its_clock_stands(robot, plan) -> None:
    """The silence is measured by the computer's steady clock."""
    with running(robot, plan, silent_after=0.5) as driver:
        result = driver.goal()
        driver.until(lambda: driver.feedback)
        driver.until(result.done, tick=False)
        answer = result.result().result
        assert answer.error_code == Result.STOPPED
        assert "no message has arrived on /" in answer.message


def test_an_error_of_the_program_stops_the_driver_and_ends_the_goal(
        robot, plan, monkeypatch) -> None:
    with running(robot, plan) as driver:
        result = driver.goal()
        driver.until(lambda: driver.feedback)

        def fails(*_: Any) -> list:
            raise RuntimeError("a bug")

        monkeypatch.setattr(driver.node._inputs, "on_imu", fails)
        driver.until(result.done)
        assert result.result().result.error_code == Result.STOPPED
        assert "RuntimeError: a bug" in result.result().result.message
        driver.until(lambda: driver.stops)


def test_a_foreign_publisher_is_named_and_its_upside_down_imu_is_dropped(robot, plan) -> None:
    with running(robot, plan) as driver:
        result = driver.goal()
        driver.until(lambda: driver.feedback)
        foreign = rclpy.create_node("neighbour")
        try:
            publisher = foreign.create_publisher(Imu, "/imu", 10)
            driver.until(lambda: publisher.get_subscription_count())
            message = Imu()
            message.orientation.x, message.orientation.w = 1.0, 0.0
            message.header.stamp = stamp_of(round((driver.now + 0.02) * 1e9))
            publisher.publish(message)
            driver.until(lambda: {
                "dropped on /imu: a value jumps", "publishers of /imu"} <= {
                    value.key for status in driver.status for value in status.values})
            named = [value.value for status in driver.status for value in status.values
                     if value.key == "publishers of /imu"]
            assert named[0] == "/driver, /neighbour"
            assert not result.done()
        finally:
            foreign.destroy_node()


def test_a_forged_plan_does_not_even_pass_a_dry_run(robot, plan) -> None:
    with running(robot, plan) as driver:
        forged = plan_message(plan, robot.joint_names, Time(), trajectories=True)
        forged.plan_id = "forged"
        forged.v_com = math.nan
        driver.plans.publish(forged)
        driver.until(lambda: driver.node._last_plan == "forged")
        result = driver.goal(dry_run=True)
        driver.until(result.done)
        assert result.result().result.error_code == Result.NO_PLAN
        assert driver.followed is None


def test_a_reset_of_the_clock_gives_the_motion_up(robot, plan) -> None:
    with running(robot, plan) as driver:
        result = driver.goal()
        driver.until(lambda: driver.feedback)
        driver.now = 0.5
        driver.until(result.done)
        assert "clock went back" in result.result().result.message
        assert np.isfinite(driver.position).all()
