"""Node impact_executor: executes a plan through the driver's topics, as an action."""

from __future__ import annotations

import math
import sys
from functools import partial
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.node import GuardedNode, run_node
from door_impact_common.parameters import Parameters, allowed_folders
from door_impact_common.stamps import NANOSECONDS, seconds, stamp_of
from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_msgs.msg import HitReport, ImpactPlan
from geometry_msgs.msg import PointStamped, WrenchStamped
from hrp2_description.robot import SIDES, load_robot_config
from hrp2_description.support import polygon_margin
from humanoid_motion.robot_model import RobotModel
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.clock import Clock, ClockType
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.task import Future
from sensor_msgs.msg import Imu, JointState
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory

from impact_planner.errors import GoalRefused
from impact_planner.execution.execution import Execution
from impact_planner.execution.freshness import Freshness
from impact_planner.execution.point_b import STANDING_SIDE, PointB
from impact_planner.execution.preflight import require_ready, require_speed_scale
from impact_planner.execution.types import Command, ExecutionSettings, Outcome
from impact_planner.ros.executor_messages import (
    executable,
    hit_report,
    joint_arrays,
    result_message,
    trunk_tilt,
)
from impact_planner.ros.messages import trajectory_message

Result = ExecuteDoorImpact.Result

FEEDBACK_PERIOD = 0.05  # time between two messages of feedback, by the robot's clock [s]
WATCH_PERIOD = 0.05  # time between two checks that messages arrive [s]
JOINTS, IMU, DOOR = "/joint_states", "/imu", "/door_angle"
PATIENCE = 20  # number of watch periods that a goal waits for the first messages
WARNING_PERIOD = 5.0  # shortest time between two warnings about unusable messages [s]
ROBOT = {"robot_config": ("", "robot.yaml to use instead of hrp2_description's")}
THRESHOLDS = {
    "stale_after": (0.5, "largest age of messages about robot and door [s]"),
    "felt_force": (ExecutionSettings.felt_force, "force of the floor on both feet towards the door "
                   "above which a contact is detected; the run-up itself must stay below it [N]"),
}


class ImpactExecutor(GuardedNode):
    """Passes messages to an `Execution`, and publishes its commands as trajectories."""

    def __init__(self) -> None:
        """Load the robot and connect to the driver's topics."""
        super().__init__("impact_executor")
        robot = Parameters(self, ROBOT, read_only=False).text("robot_config")
        thresholds = Parameters(self, THRESHOLDS)
        self._robot = RobotModel(load_robot_config(robot or None, allowed_folders(self)))
        self._point_b = PointB(self._robot)
        self._names = list(self._robot.joint_names)
        self._freshness = Freshness(
            (JOINTS, IMU, DOOR), thresholds.number("stale_after"), WATCH_PERIOD)
        self._settings = ExecutionSettings(felt_force=thresholds.number("felt_force"))
        self._plans: dict[str, ImpactPlan] = {}
        self._last_plan = ""
        self._execution: Execution | None = None
        self._finished: Future | None = None
        self._goal: Any = None
        self._busy = False
        self._stop_requested = False
        self._joints: tuple[float, Array, Array] | None = None
        self._door_angle = math.nan
        # Stamp [s] and force of the floor towards the door [N] of the last wrench of each foot.
        self._forces: dict[str, tuple[float, float]] = {}
        self._zmp: tuple[float, float] | None = None  # last ZMP, x and y in odom [m]
        self._last_feedback = -math.inf  # on the robot's clock [s]
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._trajectory = self.create_publisher(JointTrajectory, "/joint_trajectory", 10)
        self._reports = self.create_publisher(HitReport, "/hit_report", 10)
        self.create_subscription(ImpactPlan, "/door_impact_plan", self._on_plan, latched)
        self.create_subscription(JointState, JOINTS, self._on_joints, 50)
        self.create_subscription(JointState, DOOR, self._on_door, 50)
        self.create_subscription(Imu, IMU, self._on_imu, 50)
        for side in SIDES:
            self.create_subscription(
                WrenchStamped, f"/{side}_foot/wrench", partial(self._on_wrench, side), 50)
        self.create_subscription(PointStamped, "/zmp", self._on_zmp, 50)
        self.create_service(Trigger, "/stop", self._on_stop)
        self.create_timer(WATCH_PERIOD, self._watch)
        self._server = ActionServer(
            self, ExecuteDoorImpact, "/execute_door_impact", self._execute,
            goal_callback=self._on_goal, cancel_callback=self._on_cancel)

    # -- topics -------------------------------------------------------------------------------

    def _on_plan(self, message: ImpactPlan) -> None:
        self._plans = {message.plan_id: message}
        self._last_plan = message.plan_id

    def _on_zmp(self, message: PointStamped) -> None:
        self._zmp = (message.point.x, message.point.y)

    def _on_joints(self, message: JointState) -> None:
        now = seconds(message.header.stamp)
        state = joint_arrays(message, self._names)
        if state is None:
            self.get_logger().warning(
                f"a message on {JOINTS} was ignored: it must have the position and the speed of "
                "every joint", throttle_duration_sec=WARNING_PERIOD)
            return
        if self._joints is not None and now < self._joints[0]:
            self._clock_went_back()
        self._freshness.received(JOINTS, now)
        self._joints = (now, *state)
        if self._execution is not None:
            self._after(now, self._execution.on_joint_state(now, *state))

    def _clock_went_back(self) -> None:
        """Give up the motion: after a reset of the simulation its times mean nothing any more."""
        self._last_feedback = -math.inf
        self._freshness.forget()
        if self._execution is not None:
            self._execution.give_up("the motion was given up: the robot's clock went back")

    def _on_door(self, message: JointState) -> None:
        if not (message.position and message.velocity):
            return
        now, self._door_angle = seconds(message.header.stamp), message.position[0]
        self._freshness.received(DOOR, now)
        if self._execution is not None:
            velocity = message.velocity[0]
            self._after(now, self._execution.on_door(now, self._door_angle, velocity))

    def _on_imu(self, message: Imu) -> None:
        now, tilt = seconds(message.header.stamp), trunk_tilt(message)
        if tilt is None:
            self.get_logger().warning(
                f"a message on {IMU} was ignored: it must have an orientation",
                throttle_duration_sec=WARNING_PERIOD)
            return
        self._freshness.received(IMU, now)
        if self._execution is not None:
            rate = message.angular_velocity
            self._after(now, self._execution.on_imu(
                now, tilt, np.array([rate.x, rate.y, rate.z])))

    def _on_wrench(self, side: str, message: WrenchStamped) -> None:
        """Pass on the sum of both feet's forces when their wrenches are of the same tick.

        The soles are parallel to odom, in which the door is in the direction of -y.
        """
        now = seconds(message.header.stamp)
        self._forces[side] = (now, -message.wrench.force.y)
        stamps, forces = zip(*self._forces.values(), strict=True)
        if self._execution is not None and stamps == (now,) * len(SIDES):
            self._after(now, self._execution.on_foot_forces(now, sum(forces)))

    def _watch(self) -> None:
        """End a motion if messages about robot or door do not arrive any more."""
        missing = self._freshness.tick()
        if missing is not None and self._execution is not None and self._joints is not None:
            topic, waited = missing
            now = self._joints[0] + (waited if topic == JOINTS else 0.0)
            self._after(now, self._execution.on_silence(
                now, topic, waited, self._freshness.limit))

    def _after(self, now: float, commands: list[Command]) -> None:
        """Send commands and feedback, and end the action if the execution has ended."""
        for command in commands:
            self._send(command)
        if self._execution is None or self._finished is None or self._finished.done():
            return
        if self._execution.outcome is not Outcome.RUNNING:
            self._finished.set_result(self._execution.outcome)
        elif now >= self._last_feedback + FEEDBACK_PERIOD:
            self._last_feedback = now
            self._send_feedback(now)

    def _send(self, command: Command) -> None:
        if command.knots is None:
            self._trajectory.publish(JointTrajectory())
            return
        message = trajectory_message(command.knots, self._names)
        message.header.stamp = stamp_of(round(command.stamp * NANOSECONDS))
        self._trajectory.publish(message)

    def _send_feedback(self, now: float) -> None:
        assert self._execution is not None
        feedback = ExecuteDoorImpact.Feedback()
        feedback.phase = self._execution.phase
        feedback.progress = self._execution.progress(now)
        feedback.door_angle = float(self._execution.door_angle)
        feedback.zmp_margin = self._margin(self._execution.phase)
        feedback.planned_zmp_margin = self._planned_margins.get(feedback.phase, math.nan)
        self._goal.publish_feedback(feedback)

    def _margin(self, phase: str) -> float:
        """Distance between the last ZMP and the edge of the phase's support polygon [m]."""
        if self._zmp is None or self._joints is None:
            return math.nan
        sides = (STANDING_SIDE,) if phase == "step" else SIDES
        hull = self._point_b.support_polygon(self._joints[1], sides, self._standing_foot)
        return float(polygon_margin(np.array(self._zmp), hull))

    # -- action and stop ------------------------------------------------------------------------

    def _on_goal(self, goal: Any) -> GoalResponse:
        if self._busy:
            self.get_logger().warning("the goal was rejected: another goal is being executed")
            return GoalResponse.REJECT
        self._busy, self._stop_requested = True, False
        return GoalResponse.ACCEPT

    def _on_cancel(self, _: Any) -> CancelResponse:
        if self._execution is not None:
            self._execution.stop()
        return CancelResponse.ACCEPT

    def _on_stop(self, _: Any, response: Trigger.Response) -> Trigger.Response:
        response.success, self._stop_requested = True, True
        if self._execution is None:
            self._trajectory.publish(JointTrajectory())
            response.message = "nothing is being executed; the driver was commanded to stop"
        else:
            past = self._joints is not None and self._execution.past_no_return(self._joints[0])
            self._execution.stop()
            response.message = ("the point of no return has passed: the motion will be stopped "
                                "after the door's peak" if past else "the motion is being stopped")
        return response

    async def _execute(self, goal_handle: Any) -> Any:
        try:
            return await self._run(goal_handle)
        finally:
            self._execution, self._busy = None, False

    async def _run(self, goal_handle: Any) -> Any:
        goal = goal_handle.request
        try:
            plan = self._wanted(goal)
            await self._first_messages()
            if goal_handle.is_cancel_requested or self._stop_requested:
                raise GoalRefused("stopped", "the motion was stopped before it began")
            execution, command = self._prepared(goal, plan)
        except GoalRefused as error:
            (goal_handle.canceled if goal_handle.is_cancel_requested else goal_handle.abort)()
            self.get_logger().error(str(error))
            return Result(error_code=getattr(Result, error.reason.upper()), message=str(error))
        if goal.dry_run:
            goal_handle.succeed()
            return Result(success=True, message="this was a dry run: the plan "
                          f"{plan.plan_id} could be executed")
        self._goal = goal_handle
        self._finished = Future()
        self._standing_foot = (plan.left_foot.position.x, plan.left_foot.position.y)
        self._planned_margins = {each.phase: each.margin for each in plan.zmp_margins}
        self._last_feedback = -math.inf
        self._execution = execution
        self._send(command)
        outcome = await self._finished
        if execution.turned_round:
            stamp = self.get_clock().now().to_msg()
            self._reports.publish(hit_report(plan, execution.measured, stamp))
        return self._result(goal_handle, outcome)

    def _wanted(self, goal: Any) -> ImpactPlan:
        """Find the plan of a goal.

        Raises:
            GoalRefused: There is no such plan, or the speed_scale is out of its range.
        """
        require_speed_scale(goal.speed_scale)
        plan = self._plans.get(goal.plan_id or self._last_plan)
        if plan is None:
            raise GoalRefused(
                "no_plan", f"there is no plan {goal.plan_id!r}: only the last plan on "
                "/door_impact_plan can be executed" if goal.plan_id else
                "there is no plan yet: call /plan_door_impact first")
        return plan

    async def _first_messages(self) -> None:
        """Wait a moment for the first messages, by the computer's clock, as after a reset."""
        for _ in range(PATIENCE):
            if self._freshness.complete:
                return
            later = Future()
            timer = self.create_timer(WATCH_PERIOD, partial(later.set_result, None),
                                      clock=Clock(clock_type=ClockType.STEADY_TIME))
            await later
            self.destroy_timer(timer)

    def _prepared(self, goal: Any, message: ImpactPlan) -> tuple[Execution, Command]:
        """Make the execution of a goal and its first command, after all checks.

        Raises:
            GoalRefused: The goal cannot be executed.
        """
        plan = executable(message, self._names)
        stale = self._freshness.refusal(self.get_clock().now().nanoseconds * 1e-9)
        if stale is not None:
            raise GoalRefused("not_ready", stale[0], quantity="age [s]", value=stale[1])
        assert self._joints is not None
        now, position, _ = self._joints
        execution = Execution(plan, self._point_b.speed, self._settings,
                              speed_scale=goal.speed_scale, joint_names=self._names)
        command = execution.start(now)
        assert command.knots is not None
        require_ready(self._robot, plan, command.knots, position,
                      self._door_angle - message.initial_angle)
        return execution, command

    def _result(self, goal_handle: Any, outcome: Outcome) -> Any:
        assert self._execution is not None
        result = result_message(outcome, self._execution.reason, self._execution.measured)
        if outcome is Outcome.SUCCESS:
            goal_handle.succeed()
        elif goal_handle.is_cancel_requested:
            goal_handle.canceled()
        else:
            goal_handle.abort()
        self.get_logger().info(result.message)
        return result


def main(args: list[str] | None = None) -> int:
    """Run the node until it is stopped, and return its exit code."""
    return run_node(ImpactExecutor, args=args)


if __name__ == "__main__":
    sys.exit(main())
