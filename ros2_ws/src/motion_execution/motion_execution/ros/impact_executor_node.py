"""Node impact_executor: executes a plan through the driver's topics, as an action."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from functools import partial
from typing import Any

from door_impact_common.node import GuardedNode, run_node, until
from door_impact_common.parameters import Parameters
from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_msgs.msg import HitReport, ImpactPlan
from door_model.door.config import hinge_of
from hrp2_description.robot import SIDES, load_robot_config
from hrp2_description.support import polygon_margin
from humanoid_motion.driver_interface import Command
from humanoid_motion.mirror import sight
from humanoid_motion.robot_model import RobotModel
from impact_planner.errors import GoalRefused, InvalidRequest
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.task import Future
from robot_driver.active_goals import ActiveGoals
from robot_driver.messages import command_message
from robot_driver.motion import Outcome
from robot_driver.names import TRAJECTORY
from robot_driver.ranges import joint_ranges
from robot_driver.sensor_doubts import doubts
from robot_driver.topics import SILENCE, RobotTopics
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory

from motion_execution.hit.execution import Execution
from motion_execution.hit.point_b import STANDING_SIDE, PointB
from motion_execution.hit.preflight import require_ready, require_speed_scale
from motion_execution.ros.executor_messages import (
    executable,
    hit_report,
    probes,
    result_message,
)
from motion_execution.settings import ExecutionSettings

Result = ExecuteDoorImpact.Result

FEEDBACK_PERIOD = 0.05  # time between two messages of feedback, by the robot's clock [s]
WALK, PASSAGE = "/walk", "/walk_through_door"
PATIENCE = 3.0  # time that a goal waits for messages, by the computer's clock [s]
ROBOT = {
    "robot_config": ("", "robot.yaml to use instead of hrp2_description's"),
    "door": ("", "name or YAML file of the door before the robot, for the side of its hinge; "
             "empty: at the right"),
}
THRESHOLDS = {
    **SILENCE,
    "felt_force": (ExecutionSettings.felt_force, "force of the floor on both feet towards the door "
                   "above which a contact is detected; the run-up itself must stay below it [N]"),
    "contact_deceleration": (
        ExecutionSettings.contact_deceleration, "specific force of the trunk away from the door, "
        "above what the run-up needs, from which on two readings of the IMU show a contact "
        "[m/s^2]"),
}


class ImpactExecutor(GuardedNode):
    """Passes messages to an `Execution`, and publishes its commands as trajectories."""

    def __init__(self) -> None:
        """Load the robot and connect to the driver's topics."""
        super().__init__("impact_executor")
        given = Parameters(self, ROBOT, read_only=False)
        thresholds = Parameters(self, THRESHOLDS)
        self._robot = RobotModel(load_robot_config(given.text("robot_config") or None))
        self._sight = sight(self._robot.config, hinge_of(given.text("door")))
        self._point_b = PointB(self._robot)
        self._names = list(self._robot.joint_names)
        self._driver = RobotTopics(self, self._names, joint_ranges(self._robot), thresholds,
                                   self._after, partial(doubts, self._robot), door=True,
                                   sight=self._sight)
        self._inputs = self._driver.inputs
        self._execution: Execution | None = None
        self._settings = ExecutionSettings(
            felt_force=thresholds.number("felt_force"),
            contact_deceleration=thresholds.number("contact_deceleration"))
        self._plans: dict[str, ImpactPlan] = {}
        self._last_plan = ""
        self._finished: Future | None = None
        self._goal: Any = None
        self._busy = False
        self._stop_requested = False
        self._last_feedback = -math.inf  # on the robot's clock [s]
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._trajectory = self.create_publisher(JointTrajectory, TRAJECTORY, 10)
        self._reports = self.create_publisher(HitReport, "/hit_report", 10)
        self.create_subscription(ImpactPlan, "/door_impact_plan", self._on_plan, latched)
        self._walk, self._passage = ActiveGoals(self, WALK), ActiveGoals(self, PASSAGE)
        self.create_service(Trigger, "/stop", self._on_stop)
        self._server = ActionServer(
            self, ExecuteDoorImpact, "/execute_door_impact", self._execute,
            goal_callback=self.guarded(
                self._on_goal, "the goal", lambda _: GoalResponse.REJECT),
            cancel_callback=self.guarded(
                self._on_cancel, "the cancel", lambda _: CancelResponse.REJECT))

    # -- topics -------------------------------------------------------------------------------

    def _on_plan(self, message: ImpactPlan) -> None:
        self._plans = {message.plan_id: self._sight.message(message)}
        self._last_plan = message.plan_id

    def _after(self, now: float, commands: Sequence[Command]) -> None:
        """Send commands and feedback, and end the action if the execution has ended."""
        for command in commands:
            self._send(command)
        execution = self._execution
        if execution is None or self._finished is None or self._finished.done():
            return
        if execution.outcome is not Outcome.RUNNING:
            self._finished.set_result(execution.outcome)
        elif now >= self._last_feedback + FEEDBACK_PERIOD:
            self._last_feedback = now
            self._send_feedback(execution, now)

    def _send(self, command: Command) -> None:
        self._trajectory.publish(self._sight.message(command_message(command, self._names)))

    def _send_feedback(self, execution: Execution, now: float) -> None:
        feedback = ExecuteDoorImpact.Feedback()
        feedback.phase = execution.phase
        feedback.progress = execution.progress(now)
        feedback.door_angle = float(execution.door_angle)
        feedback.zmp_margin = self._margin(execution.phase)
        feedback.planned_zmp_margin = self._planned_margins.get(feedback.phase, math.nan)
        self._goal.publish_feedback(feedback)

    def _margin(self, phase: str) -> float:
        """Distance between the last ZMP and the edge of the phase's support polygon [m]."""
        if self._driver.zmp is None or self._inputs.joints is None:
            return math.nan
        sides = (STANDING_SIDE,) if phase == "step" else SIDES
        hull = self._point_b.support_polygon(self._inputs.joints[1], sides, self._standing_foot)
        return float(polygon_margin(self._driver.zmp[1], hull))

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
        execution = self._execution
        walks = [each for each in (self._walk, self._passage) if each.running]
        for each in walks:
            each.cancel()
        if execution is None and walks:
            response.message = (f"{walks[0].action} is being stopped: the robot finishes its step "
                                "and stands on two feet")
        elif execution is None:
            self._trajectory.publish(JointTrajectory())
            response.message = "nothing is being executed; the driver was commanded to stop"
        else:
            execution.stop()
            past = execution.past_no_return(self._driver.now())
            response.message = ("the point of no return has passed: the motion will be stopped "
                                "after the door's peak" if past else "the motion is being stopped")
        return response

    async def _execute(self, goal_handle: Any) -> Any:
        self._driver.start()
        try:
            return await self._run(goal_handle)
        finally:
            self._driver.stop()
            self._inputs.motion = self._execution = None
            self._busy = False

    async def _run(self, goal_handle: Any) -> Any:
        goal = goal_handle.request
        try:
            if self._walk.running:
                raise GoalRefused("not_ready", "the robot walks (/walk): a hit begins when it "
                                  "stands", quantity="action", value=WALK)
            if self._passage.running and not self._passage.asked_for(goal_handle.goal_id):
                raise GoalRefused("not_ready", "the robot goes through the door "
                                  "(/walk_through_door): another hit begins when it has ended",
                                  quantity="action", value=PASSAGE)
            plan = self._wanted(goal)
            await until(self, lambda: self._driver.complete, PATIENCE)
            if goal_handle.is_cancel_requested or self._stop_requested:
                raise GoalRefused("stopped", "the motion was stopped before it began")
            try:
                execution, command = self._prepared(goal, plan)
            except (InvalidRequest, ValueError, ArithmeticError) as error:  # of any plan's message
                raise GoalRefused(
                    "no_plan", f"the plan cannot be executed: {error}") from error
        except GoalRefused as error:
            (goal_handle.canceled if goal_handle.is_cancel_requested else goal_handle.abort)()
            message = self._sight.text(str(error))
            self.get_logger().error(message)
            return Result(error_code=getattr(Result, error.reason.upper()), message=message)
        if goal.dry_run:
            goal_handle.succeed()
            return Result(success=True, message="this was a dry run: the plan "
                          f"{plan.plan_id} could be executed")
        self._goal = goal_handle
        self._finished = Future()
        self._standing_foot = (plan.left_foot.position.x, plan.left_foot.position.y)
        self._planned_margins = {each.phase: each.margin for each in plan.zmp_margins}
        self._last_feedback = -math.inf
        self._inputs.intake.begin()
        self._inputs.motion = self._execution = execution
        self._send(command)
        outcome = await self._finished
        if execution.turned_round:
            stamp = self.get_clock().now().to_msg()
            self._reports.publish(hit_report(
                plan, goal_handle.goal_id, outcome, execution.measured, stamp))
        return self._result(goal_handle, execution, outcome)

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

    def _prepared(self, goal: Any, message: ImpactPlan) -> tuple[Execution, Command]:
        """Make the execution of a goal and its first command, after all checks.

        Raises:
            GoalRefused: The goal cannot be executed.
        """
        plan = executable(message, self._names)
        stale = self._driver.refusal()
        if stale is not None:
            raise GoalRefused("not_ready", stale[0], quantity="age [s]", value=stale[1])
        assert self._inputs.joints is not None
        now, position, _ = self._inputs.joints
        execution = Execution(plan, self._point_b, self._settings,
                              speed_scale=goal.speed_scale, joint_names=self._names,
                              probe=probes(goal, message))
        require_ready(self._robot, plan, position,
                      self._inputs.door_angle - message.initial_angle)
        return execution, execution.start(now)

    def _result(self, goal_handle: Any, execution: Execution, outcome: Outcome) -> Any:
        reason = self._sight.text(execution.reason)
        result = result_message(outcome, reason, execution.measured)
        if outcome is Outcome.SUCCESS:
            goal_handle.succeed()
        elif goal_handle.is_cancel_requested:
            goal_handle.canceled()
        else:
            goal_handle.abort()
        self.get_logger().info(result.message)
        if result.contact_sensor:
            self.get_logger().info(f"the contact was shown by: {result.contact_sensor}")
        for what, value in self._inputs.intake.noticed().items():
            self.get_logger().warning(f"noticed in the motion: {self._sight.text(what)}: {value}")
        return result


def main(args: list[str] | None = None) -> int:
    """Run the node until it is stopped, and return its exit code."""
    return run_node(ImpactExecutor, args=args)


if __name__ == "__main__":
    sys.exit(main())
