"""The robot, the planner and the viewers as the node motion_server hears and tells them."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import replace
from typing import Any

from door_impact_common.arrays import Array
from door_impact_common.node import GuardedNode
from door_impact_common.parameters import FRAME_PREFIX, Parameters
from door_impact_common.stamps import seconds
from door_impact_msgs.msg import CloserParameters, Footsteps, HandCompliance, ImpactPlan
from door_impact_msgs.srv import PlanDoorImpact
from door_model.door.config import load_door
from door_model.door.geometry import before
from door_model.errors import DoorModelError
from door_model.ros.messages import door_of
from geometry_msgs.msg import PoseWithCovarianceStamped
from hrp2_description.robot import load_robot_config
from humanoid_motion.driver_interface import Command
from humanoid_motion.mirror import sight
from humanoid_motion.robot_model import RobotModel
from impact_planner.errors import GoalRefused
from impact_planner.task.known_door import KnownDoor
from rclpy.qos import DurabilityPolicy, QoSProfile
from robot_driver.messages import command_message
from robot_driver.topics import SILENCE, RobotTopics
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray
from walking.errors import BadDoorPose, HitNotPlanned, InvalidGoal, NotReady
from walking.footsteps.footstep import Footstep, Pose, other

from motion_execution.mission.hit_plan import HitPlan
from motion_execution.mission.link import HitRequest, Link
from motion_execution.ros.controller import Controller
from motion_execution.ros.hit_messages import hit_plan_of
from motion_execution.ros.passage_messages import door_pose
from motion_execution.ros.planning_process import PlanningProcess
from motion_execution.ros.walk_messages import ODOM, base_pose, footstep_markers, footsteps_message

PARAMETERS = {
    "robot_config": ("", "robot.yaml to use instead of hrp2_description's"),
    "door": ("", "name or YAML file of the door, for its frame and the side of its hinge, and for "
             "its closer while nothing is identified; empty: no frame, and a hinge at the right"),
    "frame_prefix": FRAME_PREFIX,
}
PLAN, DOOR_POSE = "plan_door_impact", "door_pose"
_PATIENCE = 5.0  # time in which the planner must be found, by the computer's clock [s]
_LONGEST = 60.0  # longest time that it may take, by the computer's clock [s]
_OLDEST = 5.0  # largest age of a message on door_pose when a goal arrives [s]
_PUSH_THROTTLE = 1.0  # shortest time between two equal warnings [s]


class RosLink(Link):
    """Topics, the planner's service, and a process that plans.

    Args:
        node: The node; it gets the parameters `PARAMETERS`, `stale_after`, `silent_after`, and
            those of `Controller`.
        after: As of `RobotTopics`.
        follows: As of `Controller`.
        refused: As of `Controller`.

    Attributes:
        model: The robot.
        door: What is known of the door.
        last_hit: The last hit that was planned by anyone.
        hinge: Side of the door's hinge; before one at the left all is that of the mirror image.
        sight: How the mission sees robot and door.
        world: Name of the frame odom.
    """

    def __init__(
        self, node: GuardedNode, after: Callable[[float, Sequence[Command]], None],
        follows: Callable[[float, Array], None], refused: Callable[[str], None],
    ) -> None:
        self._node, given = node, Parameters(node, PARAMETERS)
        robot = given.text("robot_config") or None
        self.model = RobotModel(load_robot_config(robot))
        name, self._prefix = given.text("door"), given.text("frame_prefix")
        self.world = self._prefix + ODOM
        door = load_door(name) if name else None
        self.door = None if door is None else KnownDoor.configured(door)
        self.last_hit: HitPlan | None = None
        self.hinge = "right" if door is None else door.hinge
        self.sight = sight(self.model.config, self.hinge)
        self._names = list(self.model.joint_names)
        self._topics = RobotTopics(
            node, self.model, Parameters(node, SILENCE), after,
            further=[(TFMessage, "/tf", self._on_tf)], sight=self.sight)
        self.inputs = self._topics.inputs
        self._base: tuple[float, Pose] | None = None
        self._told: Any = None  # last message on door_pose
        self._last_plan: Any = None
        self._numbers = itertools.count(1)  # of the passages that were planned
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._controller = Controller(node, self._names, self.sight, follows, refused)
        self._compliance = node.create_publisher(HandCompliance, "hand_compliance", 10)
        self._footsteps = node.create_publisher(Footsteps, "footsteps", latched)
        self._markers = node.create_publisher(MarkerArray, "footstep_markers", latched)
        self._planner = node.create_client(PlanDoorImpact, PLAN)
        node.create_subscription(PoseWithCovarianceStamped, DOOR_POSE, self._on_pose, 10)
        node.create_subscription(
            CloserParameters, "closer_parameters", self._on_closer, latched)
        node.create_subscription(ImpactPlan, "door_impact_plan", self._on_plan, latched)
        self._planning = PlanningProcess(robot)
        self.show(())

    def close(self) -> None:
        """End the planning process after the work that it has begun."""
        self._planning.close()

    # -- what is known --------------------------------------------------------------------------

    def now(self) -> float:
        """Return the present time of the robot's clock [s]."""
        return self._topics.now()

    def clock(self) -> float:
        """Return the time of the computer's steady clock, without pauses of a simulation [s]."""
        return self._topics.awake

    def listen(self, *, on: bool) -> None:
        """Subscribe to the robot's topics, or end that."""
        (self._topics.start if on else self._topics.stop)()

    def refusal(self, topics: Sequence[str]) -> tuple[str, float] | None:
        """Return why no motion with topics can begin; None if one can."""
        if self._controller.silence:
            return self._controller.silence, math.inf
        return self._topics.refusal(topics)

    def base(self) -> tuple[float, Pose] | None:
        """Return stamp [s] and pose of base_link in odom by /tf; None before the first."""
        return self._base

    def zmp(self) -> Any:
        """Return stamp [s] and place of the last ZMP in odom, (2,) [m]; None before the first."""
        return self._topics.zmp

    @property
    def yields(self) -> bool:
        """Whether the driver can let a hand yield."""
        return self._compliance.get_subscription_count() > 0

    def door_pose(self, along: float) -> Pose | None:
        """Return the door's pose in odom by door_pose; None if nobody tells it.

        Args:
            along: Distance from the hinge at which the leaf is touched [m].

        Raises:
            BadDoorPose: It makes no sense, is too old or too uncertain.
        """
        if self._told is None:
            return None
        age = self.now() - seconds(self._told.header.stamp)
        if not abs(age) <= _OLDEST:
            raise BadDoorPose(quantity=f"age of {DOOR_POSE} [s]", value=round(age, 1),
                              limit=f"at most {_OLDEST:g}")
        return self.turned(door_pose(self._told, along, self.world))

    def hit_plan(self, plan_id: str) -> HitPlan:
        """Return the last plan of a hit, as it is seen.

        Args:
            plan_id: Its identifier; empty: whichever it is.

        Raises:
            GoalRefused: There is no such plan, or a number of it makes no sense.
        """
        last = self._last_plan
        if last is None or plan_id not in ("", last.plan_id):
            raise GoalRefused(
                "no_plan", f"there is no plan {plan_id!r}: only the last plan on "
                "door_impact_plan can be executed" if plan_id else
                "there is no plan yet: call plan_door_impact first")
        return self._seen(last)

    def turned(self, pose: Pose) -> Pose:
        """Return a pose in odom as it is seen, or one that is seen as it is in odom."""
        return Pose(*before(self.hinge, pose))

    def next_number(self) -> int:
        """Return the number of the next passage that is planned."""
        return next(self._numbers)

    # -- what is sent ---------------------------------------------------------------------------

    def send(self, command: Command) -> None:
        """Send a trajectory to the driver."""
        self._controller.send(self.sight.message(command_message(command, self._names)))

    def comply(self, *impedance: float) -> None:
        """Let the right hand yield, [N/m, N s/m, kg]; without numbers it gets stiff."""
        message = HandCompliance(side="right")  # stiff
        if impedance:
            message.stiffness, message.damping, message.mass = impedance
        message.header.stamp = self._stamp()
        self._compliance.publish(self.sight.message(message))

    def show(self, footsteps: Sequence[Footstep]) -> None:
        """Show footsteps to viewers."""
        if self.hinge == "left":
            footsteps = [Footstep(other(step.side), *self.turned(step.pose), step.duration)
                         for step in footsteps]
        stamp = self._stamp()
        self._footsteps.publish(footsteps_message(footsteps, stamp, self.world))
        self._markers.publish(footstep_markers(self.model.config, footsteps, stamp, self.world))

    def say(self, text: str, *, warning: bool = False) -> None:
        """Log a sentence."""
        log, text = self._node.get_logger(), self.sight.text(text)
        if warning:
            log.warning(text, throttle_duration_sec=_PUSH_THROTTLE)
        else:
            log.info(text)

    # -- plans ----------------------------------------------------------------------------------

    def compute(self, work: Callable[..., Any], *args: Any) -> Future[Any]:
        """Begin to call a function in the planning process, with its robot."""
        return self._planning.submit(work, *args)

    def plan_hit(self, request: HitRequest) -> PlannedHit:
        """Begin to have the planner plan a hit."""
        return PlannedHit(self._planner, self._seen, PlanDoorImpact.Request(
            desired_opening_angle=request.angle, run_up=request.run_up, ending=request.ending,
            door_distance=request.door_distance, l_b=request.l_b, include_trajectories=True))

    def _seen(self, plan: ImpactPlan) -> HitPlan:
        return hit_plan_of(self.sight.message(plan), self._names)

    # -- messages -------------------------------------------------------------------------------

    def _on_tf(self, message: TFMessage) -> None:
        heard = base_pose(message, self.model.config.root_link, self._prefix)
        if heard is not None:
            self._base = heard[0], self.turned(heard[1])

    def _on_pose(self, message: PoseWithCovarianceStamped) -> None:
        self._told = message

    def _on_closer(self, message: CloserParameters) -> None:
        try:
            found = door_of(message)
        except DoorModelError as error:
            self._node.get_logger().error(f"closer_parameters describes no door: {error}")
            return
        if self.door is not None and self.door.name == message.door:
            self.door = replace(self.door, door=found)

    def _on_plan(self, message: ImpactPlan) -> None:
        self._last_plan = message
        self.last_hit = None
        with suppress(GoalRefused):  # whoever wants to execute it is told why
            self.last_hit = self._seen(message)

    def _stamp(self) -> Any:
        return self._node.get_clock().now().to_msg()


class PlannedHit:
    """A plan that the planner is asked for as soon as it is there.

    Args:
        planner: Client of the planner's service.
        seen: Function that converts a plan's message.
        request: What to ask for.
    """

    def __init__(
        self, planner: Any, seen: Callable[[ImpactPlan], HitPlan], request: PlanDoorImpact.Request
    ) -> None:
        self._planner, self._seen, self._request = planner, seen, request
        self._began = time.monotonic()
        self._future: Any = None

    def done(self) -> bool:
        """Whether the planner has answered, or does not."""
        waited = time.monotonic() - self._began
        if self._future is None and self._planner.service_is_ready():
            self._future = self._planner.call_async(self._request)
        if self._future is None:
            return waited >= _PATIENCE
        return bool(self._future.done()) or waited >= _LONGEST

    def result(self) -> HitPlan:
        """Return the plan, as it is seen.

        Raises:
            InvalidGoal: A value makes no sense.
            HitNotPlanned: There is no such hit.
            NotReady: The planner does not answer.
        """
        if self._future is None:
            raise NotReady(f"nobody serves {PLAN}: does the node impact_planner run?",
                           quantity="name", value=PLAN)
        if not self._future.done():
            raise NotReady(f"{PLAN} has not answered within {_LONGEST:g} s", quantity="service",
                           value=PLAN)
        answer = self._future.result()
        if answer.success:
            return self._seen(answer.plan)
        invalid = answer.error_code == PlanDoorImpact.Response.INVALID_REQUEST
        raise (InvalidGoal if invalid else HitNotPlanned)(
            f"the hit cannot be planned: {answer.message}", quantity="error_code",
            value=answer.error_code)
