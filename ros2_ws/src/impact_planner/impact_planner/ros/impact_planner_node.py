"""Node impact_planner: plans an impact from the identified or configured door."""

from __future__ import annotations

import math
import sys
import traceback
from dataclasses import replace
from pathlib import Path
from typing import Any

from door_impact_common.errors import DoorImpactError
from door_impact_common.node import GuardedNode, run_node
from door_impact_common.parameters import FRAME_PREFIX, Parameters
from door_impact_msgs.msg import CloserParameters, HitReport
from door_impact_msgs.msg import ImpactPlan as ImpactPlanMessage
from door_impact_msgs.srv import PlanDoorImpact
from door_model.door.config import load_door, load_geometry
from hrp2_description.robot import load_robot_config
from humanoid_motion.mirror import sight
from humanoid_motion.robot_model import RobotModel
from rcl_interfaces.msg import SetParametersResult
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_srvs.srv import Trigger

from impact_planner.errors import PLANNING_ERRORS, InvalidRequest, NoDoor
from impact_planner.impact_plan import ImpactPlan
from impact_planner.plan import plan_impact
from impact_planner.ros.hit_learner import HitLearner
from impact_planner.ros.messages import (
    door_from_message,
    failure_response,
    plan_message,
    request_from_message,
)
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.settings import PlannerSettings, make_settings, parameters_of

NAME = "impact_planner"
WAITING = 100  # number of requests that wait while one is planned; ROS 2's default is 10
PARAMETERS: dict[str, tuple[Any, str]] = {
    "door": ("", "name or YAML file of a door, to plan without identification"),
    "frame_of": ("", "name or YAML file of the identified door, for its frame and wall, and the "
                 "side of its hinge; empty: they are not known, and it is at the right"),
    "frame_prefix": FRAME_PREFIX,
    "robot_config": ("", "robot.yaml to use instead of hrp2_description's"),
    "experience_file": ("", "YAML file that keeps what hits have taught, by door; empty: it is "
                        "forgotten with the node"),
}


class ImpactPlanner(GuardedNode):
    """Answers plan_door_impact; the door comes from a topic or from a parameter."""

    def __init__(self) -> None:
        """Read the parameters, load the robot and connect to topics and services."""
        super().__init__(NAME)
        self._given = Parameters(self, PARAMETERS, read_only=False)
        self._robot = RobotModel(load_robot_config(self._given.text("robot_config") or None))
        self._own = parameters_of(self._robot)  # their defaults depend on the robot
        Parameters(self, self._own, read_only=False)
        self._settings: PlannerSettings = make_settings(self._values(), self._robot)
        self._configured = self._configured_door(self._given.text("door"))
        name = self._given.text("frame_of")
        self._geometry = load_geometry(name) if name else None
        name = self._given.text("experience_file")
        self._learner = HitLearner(
            Path(name).expanduser() if name else None, self.get_logger())
        self._identified: KnownDoor | None = None
        self._refusal = ""  # why the last identified parameters describe no door
        self.add_on_set_parameters_callback(self._on_parameters)
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._plans = self.create_publisher(ImpactPlanMessage, "door_impact_plan", latched)
        self.create_subscription(CloserParameters, "closer_parameters", self._on_closer, latched)
        self.create_subscription(HitReport, "hit_report", self._learner.on_report, 10)
        self.create_service(PlanDoorImpact, "plan_door_impact", self._on_plan,
                            qos_profile=QoSProfile(depth=WAITING))
        self.create_service(Trigger, "forget_hits", self._on_forget)

    def _values(self) -> dict[str, Any]:
        return {name: self._given.value(name) for name in self._own}

    def _on_parameters(self, parameters: list[Any]) -> SetParametersResult:
        changed = {parameter.name: parameter.value for parameter in parameters}
        try:
            own = {name: value for name, value in changed.items() if name in self._own}
            settings = make_settings({**self._values(), **own}, self._robot)
            if "door" in changed:
                self._configured = self._configured_door(str(changed["door"]))
        except DoorImpactError as error:
            return SetParametersResult(successful=False, reason=str(error))
        self._settings = settings
        return SetParametersResult(successful=True)

    def _on_closer(self, message: CloserParameters) -> None:
        try:
            self._identified = door_from_message(message, self._geometry)
            self._refusal = ""
        except NoDoor as error:
            self._refusal = str(error)
            self.get_logger().error(self._refusal)

    def _door(self) -> KnownDoor:
        known = self._identified or self._configured
        if known is not None:
            older = () if not self._refusal else (
                f"the plan is for the door {known.name!r}, because the newest parameters were "
                f"refused: {self._refusal}",)
            return replace(
                known, experience=self._learner.experience(known.name),
                warnings=known.warnings + older)
        raise NoDoor(
            self._refusal
            or "nothing is known of the door: no message has arrived on "
            f"{self.resolve_topic_name('closer_parameters')}, and the parameter 'door' is empty; "
            f"call {self.resolve_service_name('identify_closer')} first",
            quantity="door",
            value="",
        )

    def _on_plan(
        self, request: PlanDoorImpact.Request, response: PlanDoorImpact.Response
    ) -> PlanDoorImpact.Response:
        """Plan a hit; an error is returned to the caller and leaves the last plan as it is."""
        try:
            wanted, known = request_from_message(request), self._door()
            plan = plan_impact(wanted, known, self._robot, self._settings)
        except PLANNING_ERRORS as error:
            self.get_logger().warning(f"no plan was made: {error}")
            return failure_response(response, error)
        except Exception as error:  # the service must answer, and the node must go on
            self.get_logger().error(traceback.format_exc())
            return failure_response(
                response, InvalidRequest(f"the planner failed: {type(error).__name__}: {error}")
            )
        self._learner.planned(plan, known)
        stamp = self.get_clock().now().to_msg()
        whole = self._message(plan, known, stamp, trajectories=True)
        self._plans.publish(whole)
        response.success = True
        response.error_code = PlanDoorImpact.Response.NONE
        response.message = (
            f"the door will open to {math.degrees(plan.peak_angle):.1f} deg: "
            f"w' = {plan.omega_door:.3f} rad/s after a hit at v_rB = {plan.v_rb:.3f} m/s; the "
            f"planning took {1e3 * plan.planning_time:.0f} ms"
        )
        response.plan = (
            whole
            if request.include_trajectories
            else self._message(plan, known, stamp, trajectories=False)
        )
        self.get_logger().info(f"plan {plan.plan_id}: {response.message}")
        for warning in whole.warnings:
            self.get_logger().warning(warning)
        return response

    def _message(
        self, plan: ImpactPlan, known: KnownDoor, stamp: Any, *, trajectories: bool
    ) -> ImpactPlanMessage:
        made: ImpactPlanMessage = sight(self._robot.config, known.hinge).message(
            plan_message(plan, self._robot.joint_names, stamp, trajectories=trajectories))
        # Not before: a mirror would exchange left and right in the prefix, too.
        made.header.frame_id = self._given.text("frame_prefix") + made.header.frame_id
        return made

    def _on_forget(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Forget what the hits on all doors have taught."""
        response.success, response.message = self._learner.forget()
        return response

    def _configured_door(self, name: str) -> KnownDoor | None:
        return KnownDoor.configured(load_door(name)) if name else None


def main(args: list[str] | None = None) -> int:
    """Run the node until it is stopped, and return its exit code."""
    return run_node(ImpactPlanner, args=args)


if __name__ == "__main__":
    sys.exit(main())
