"""Node impact_executor: runs a plan through the driver's topics, as an action."""

from __future__ import annotations

import math
import sys
from dataclasses import asdict
from typing import Any

import numpy as np
from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_msgs.msg import ImpactPlan
from door_model.node_main import run_node
from geometry_msgs.msg import PointStamped
from hrp2_description.errors import DescriptionError
from hrp2_description.robot import load_robot_config
from hrp2_description.support import polygon_margin
from numpy.typing import NDArray
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.task import Future
from rclpy.time import Time
from sensor_msgs.msg import Imu, JointState
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory

from .errors import PlannerError
from .execution import Command, ExecutablePlan, Execution, Outcome, missing_phases
from .messages import knots_from_message, trajectory_message
from .point_b import PointB
from .robot_model import RobotModel

Array = NDArray[np.float64]
Result = ExecuteDoorImpact.Result

START_TOLERANCE = 0.05  # [rad] between the robot and the posture that the plan starts from
FEEDBACK_PERIOD = 0.05  # [s]
SLOWEST = 0.05  # speed_scale
ERROR_CODES = {
    Outcome.SUCCESS: Result.NONE,
    Outcome.NO_CONTACT: Result.NO_CONTACT,
    Outcome.STOPPED: Result.STOPPED,
    Outcome.FELL: Result.FELL,
}
MESSAGES = {
    Outcome.SUCCESS: "the door was opened and held",
    Outcome.NO_CONTACT: "the run-up ended without a hit",
    Outcome.STOPPED: "stopped before the hit",
    Outcome.FELL: "the robot fell",
}


class ImpactExecutor(Node):
    """Turns messages into calls of `Execution` and its commands into trajectories."""

    def __init__(self) -> None:
        """Loads the robot and connects to the driver's topics."""
        super().__init__("impact_executor")
        self._robot = load_robot_config()
        self._point_b = PointB(RobotModel(self._robot))
        self._names = list(self._robot.joint_names)
        self._plans: dict[str, ImpactPlan] = {}
        self._last_plan = ""
        self._execution: Execution | None = None
        self._finished: Future | None = None
        self._goal: Any = None
        self._busy = False
        self._joints: tuple[float, Array, Array] | None = None
        self._zmp: tuple[float, float] | None = None
        self._fed_back = -math.inf
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._trajectory = self.create_publisher(JointTrajectory, "/joint_trajectory", 10)
        self.create_subscription(ImpactPlan, "/door_impact_plan", self._on_plan, latched)
        self.create_subscription(JointState, "/joint_states", self._on_joints, 50)
        self.create_subscription(JointState, "/door_angle", self._on_door, 50)
        self.create_subscription(Imu, "/imu", self._on_imu, 50)
        self.create_subscription(PointStamped, "/zmp", self._on_zmp, 50)
        self.create_service(Trigger, "/stop", self._on_stop)
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
        now = _seconds(message.header.stamp)
        state = self._in_order(message)
        if state is None:
            self.get_logger().warning(
                "a message on /joint_states without position and speed of each of the "
                f"{len(self._names)} joints is passed over", throttle_duration_sec=5.0)
            return
        position, velocity = state
        if self._joints is not None and now < self._joints[0]:
            self._clock_went_back()
        self._joints = (now, position, velocity)
        if self._execution is not None:
            self._after(now, self._execution.on_joint_state(now, position, velocity))

    def _in_order(self, message: JointState) -> tuple[Array, Array] | None:
        """Positions and speeds in the robot's order, None where one is missing or no number."""
        names = list(message.name)
        if not (len(names) == len(message.position) == len(message.velocity)
                and set(self._names) <= set(names)):
            return None
        position, velocity = np.array(message.position), np.array(message.velocity)
        if names != self._names:  # another driver may order them otherwise
            order = [names.index(name) for name in self._names]
            position, velocity = position[order], velocity[order]
        if not (np.isfinite(position).all() and np.isfinite(velocity).all()):
            return None
        return position, velocity

    def _clock_went_back(self) -> None:
        """After a reset of the simulation nothing that was planned in time holds any more."""
        self._fed_back = -math.inf
        if self._execution is not None and self._execution.outcome is Outcome.RUNNING:
            self.get_logger().warning("time went back: the motion is given up")
            self._execution.outcome = Outcome.STOPPED

    def _on_door(self, message: JointState) -> None:
        if self._execution is not None and message.position and message.velocity:
            now = _seconds(message.header.stamp)
            commands = self._execution.on_door(now, message.position[0], message.velocity[0])
            self._after(now, commands)

    def _on_imu(self, message: Imu) -> None:
        if self._execution is not None:
            q = message.orientation
            tilt = math.acos(max(-1.0, min(1.0, 1.0 - 2.0 * (q.x**2 + q.y**2))))
            self._after(_seconds(message.header.stamp), self._execution.on_tilt(tilt))

    def _after(self, now: float, commands: list[Command]) -> None:
        """Sends commands, gives feedback, and ends the action where the execution has ended."""
        for command in commands:
            self._send(command)
        if self._execution is None or self._finished is None or self._finished.done():
            return
        if self._execution.outcome is not Outcome.RUNNING:
            self._finished.set_result(self._execution.outcome)
        elif now >= self._fed_back + FEEDBACK_PERIOD:
            self._fed_back = now
            self._give_feedback(now)

    def _send(self, command: Command) -> None:
        if command.knots is None:
            self._trajectory.publish(JointTrajectory())
            return
        message = trajectory_message(command.knots, self._names)
        message.header.stamp = Time(nanoseconds=round(command.stamp * 1e9)).to_msg()
        self._trajectory.publish(message)

    def _give_feedback(self, now: float) -> None:
        assert self._execution is not None
        feedback = ExecuteDoorImpact.Feedback()
        feedback.phase = self._execution.phase
        feedback.progress = self._execution.progress(now)
        feedback.door_angle = float(self._execution.door_angle)
        feedback.zmp_margin = self._margin(self._execution.phase)
        self._goal.publish_feedback(feedback)

    def _margin(self, phase: str) -> float:
        """Distance of the last ZMP to the edge of the polygon that the phase stands on [m]."""
        if self._zmp is None or self._joints is None:
            return math.nan
        soles = ("left",) if phase == "step" else ("left", "right")
        hull = self._point_b.support_polygon(self._joints[1], soles, self._left_foot)
        return float(polygon_margin(np.array(self._zmp), hull))

    # -- action and stop ------------------------------------------------------------------------

    def _on_goal(self, goal: Any) -> GoalResponse:
        if self._busy:
            self.get_logger().warning("goal refused: another one is being executed")
            return GoalResponse.REJECT
        self._busy = True
        return GoalResponse.ACCEPT

    def _on_cancel(self, _: Any) -> CancelResponse:
        if self._execution is not None:
            self._execution.stop()
        return CancelResponse.ACCEPT

    def _on_stop(self, _: Any, response: Trigger.Response) -> Trigger.Response:
        response.success = True
        if self._execution is None:
            self._trajectory.publish(JointTrajectory())
            response.message = "nothing is being executed; the driver was told to hold still"
        else:
            past = self._joints is not None and self._execution.past_no_return(self._joints[0])
            self._execution.stop()
            response.message = ("past the point of no return: the hit is completed first"
                                if past else "stopping")
        return response

    async def _execute(self, goal_handle: Any) -> Any:
        try:
            return await self._run(goal_handle)
        finally:
            self._execution, self._busy = None, False

    async def _run(self, goal_handle: Any) -> Any:
        goal = goal_handle.request
        if goal_handle.is_cancel_requested:
            goal_handle.canceled()
            return Result(success=False, error_code=Result.STOPPED, message=MESSAGES[
                Outcome.STOPPED])
        refused = self._refusal(goal)
        if refused is not None:
            goal_handle.abort()
            code, message = refused
            self.get_logger().error(message)
            return Result(success=False, error_code=code, message=message)
        plan = self._plans[goal.plan_id or self._last_plan]
        if goal.dry_run:
            goal_handle.succeed()
            return Result(success=True, message=f"dry run: plan {plan.plan_id} could be executed")
        self._goal = goal_handle
        self._finished = Future()
        self._left_foot = (plan.left_foot.position.x, plan.left_foot.position.y)
        assert self._joints is not None
        self._execution = Execution(_executable(plan, self._names), self._point_b.speed,
                                    speed_scale=goal.speed_scale)
        self._fed_back = -math.inf
        self._send(self._execution.start(self._joints[0]))
        return self._result(goal_handle, await self._finished)

    def _refusal(self, goal: Any) -> tuple[int, str] | None:
        """Error code and reason where a goal cannot be run."""
        if not SLOWEST <= goal.speed_scale <= 1.0:
            return Result.INVALID_GOAL, (f"speed_scale {goal.speed_scale:g} is not between "
                                         f"{SLOWEST} and 1")
        plan = self._plans.get(goal.plan_id or self._last_plan)
        if plan is None:
            return Result.NO_PLAN, (f"no plan {goal.plan_id!r}" if goal.plan_id else
                                    "no plan yet: call /plan_door_impact first")
        if self._joints is None:
            return Result.NOT_READY, "no /joint_states heard yet"
        missing = missing_phases([phase.name for phase in plan.phases])
        if missing:
            return Result.NO_PLAN, f"the plan lacks the phases {', '.join(missing)}"
        start = knots_from_message(plan.phases[0].trajectory, self._names).position[0]
        off = np.abs(self._joints[1] - start)
        worst = int(np.argmax(off))
        if off[worst] > START_TOLERANCE:
            return Result.NOT_READY, (
                f"the robot is not where the plan starts: {self._names[worst]} is off by "
                f"{off[worst]:.3f} rad, more than {START_TOLERANCE} rad; bring it back "
                "to its initial posture (in simulation: /sim/reset)")
        return None

    def _result(self, goal_handle: Any, outcome: Outcome) -> Any:
        assert self._execution is not None
        result = Result(
            success=outcome is Outcome.SUCCESS, error_code=ERROR_CODES[outcome],
            message=MESSAGES[outcome], **asdict(self._execution.measured))
        if outcome is Outcome.SUCCESS:
            goal_handle.succeed()
        elif goal_handle.is_cancel_requested:
            goal_handle.canceled()
        else:
            goal_handle.abort()
        self.get_logger().info(result.message)
        return result


def _executable(plan: ImpactPlan, names: list[str]) -> ExecutablePlan:
    phases = {phase.name: knots_from_message(phase.trajectory, names) for phase in plan.phases}
    return ExecutablePlan(phases, plan.contact_time, plan.switch_time, plan.v_com_post / plan.v_com,
                          plan.point_of_no_return)


def _seconds(stamp: Any) -> float:
    return float(stamp.sec + 1e-9 * stamp.nanosec)


def main(args: list[str] | None = None) -> int:
    """Run the node until it is told to end."""
    return run_node(ImpactExecutor, errors=(PlannerError, DescriptionError), args=args)


if __name__ == "__main__":
    sys.exit(main())
