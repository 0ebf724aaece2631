"""The robot as this package's nodes hear it, move it, and show its steps."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial

from door_impact_common.node import GuardedNode
from door_impact_common.parameters import Parameters
from door_impact_msgs.msg import Footsteps
from door_model.door.geometry import before
from hrp2_description.robot import load_robot_config
from hrp2_description.support import polygon_margin, support_polygon
from humanoid_motion.driver_interface import Command
from humanoid_motion.mirror import sight
from humanoid_motion.robot_model import RobotModel
from rclpy.qos import DurabilityPolicy, QoSProfile
from robot_driver.messages import command_message
from robot_driver.names import TRAJECTORY
from robot_driver.ranges import joint_ranges
from robot_driver.sensor_doubts import doubts
from robot_driver.topics import SILENCE, RobotTopics
from tf2_msgs.msg import TFMessage
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import MarkerArray
from walking.errors import NotReady
from walking.footsteps.footstep import Footstep, Pose, Stance, other

from motion_execution.ros.messages import base_pose, footstep_markers, footsteps_message
from motion_execution.walk.start import Standing, soles_at
from motion_execution.walk.stepping import Stepping

PATIENCE = 3.0  # time that a goal waits for messages, by the computer's clock [s]
ROBOT = {"robot_config": ("", "robot.yaml to use instead of hrp2_description's")}


class WalkingRobot:
    """Topics of the driver and of the odometry.

    Args:
        node: The node; it gets the parameters `robot_config`, `stale_after` and `silent_after`.
        after: As of `RobotTopics`.
        at_door: Whether the door's angle and the force on the right hand are heard, too.
        hinge: Side of the door's hinge; before one at the left all is that of the mirror image.

    Attributes:
        model: The robot.
        topics: Topics about robot and door, with their measurements.
        sight: How the node sees them.
    """

    def __init__(
        self, node: GuardedNode, after: Callable[[float, Sequence[Command]], None], *,
        at_door: bool = False, hinge: str = "right",
    ) -> None:
        self._node = node
        name = Parameters(node, ROBOT, read_only=False).text("robot_config")
        self.model = RobotModel(load_robot_config(name or None))
        self.sight = sight(self.model.config, hinge)
        self._hinge = hinge
        self.topics = RobotTopics(
            node, self.model.joint_names, joint_ranges(self.model), Parameters(node, SILENCE),
            after, partial(doubts, self.model), door=at_door, hand=at_door,
            further=[(TFMessage, "/tf", self._on_tf)], sight=self.sight)
        # Stamp [s], and pose of base_link in odom, as seen from above.
        self._base: tuple[float, Pose] | None = None
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._trajectory = node.create_publisher(JointTrajectory, TRAJECTORY, 10)
        self._footsteps = node.create_publisher(Footsteps, "/footsteps", latched)
        self._markers = node.create_publisher(MarkerArray, "/footstep_markers", latched)

    def send(self, command: Command) -> None:
        """Send a trajectory to the driver."""
        message = command_message(command, self.model.joint_names)
        self._trajectory.publish(self.sight.message(message))

    def show(self, footsteps: Sequence[Footstep]) -> None:
        """Show footsteps to viewers."""
        stamp = self._node.get_clock().now().to_msg()
        if self._hinge == "left":
            footsteps = [Footstep(other(step.side), *self.turned(step.pose), step.duration)
                         for step in footsteps]
        self._footsteps.publish(footsteps_message(footsteps, stamp))
        self._markers.publish(footstep_markers(self.model.config, footsteps, stamp))

    def turned(self, pose: Pose) -> Pose:
        """Return a pose in odom as it is seen, or one that is seen as it is in odom."""
        return Pose(*before(self._hinge, pose))

    @property
    def heard(self) -> bool:
        """Whether enough messages of the driver and of the odometry have arrived."""
        return self.topics.complete and self.soles() is not None

    def soles(self) -> Stance | None:
        """Return the poses of the soles by the odometry; None without recent messages."""
        base, joints, oldest = self._base, self.topics.inputs.joints, self.topics.freshness.limit
        if base is None or joints is None or abs(base[0] - joints[0]) > oldest:
            return None
        return soles_at(self.model, base[1], joints[1])

    def standing(self) -> Standing:
        """Return what is known of a robot that stands.

        Raises:
            NotReady: Messages are missing or old.
        """
        stale, inputs = self.topics.refusal(), self.topics.inputs
        if stale is not None:
            raise NotReady(stale[0], quantity="age [s]", value=stale[1])
        if self._base is None or inputs.joints is None or self.soles() is None:
            raise NotReady("no recent odometry has arrived on /tf (odom -> base_link): does "
                           "zmp_publisher run?", quantity="/tf", value=None)
        _, position, velocity = inputs.joints
        return Standing(self._base[1], inputs.tilt, position, velocity)

    def margin(self, soles: Stance, walk: Stepping, now: float) -> float:
        """Return the distance between the last ZMP and the edge of the soles that bear load [m].

        It is NaN where the last ZMP is of a time at which other soles should bear load.

        Args:
            soles: The soles by the odometry.
            walk: The walk, which tells the soles that should bear load.
            now: Time of the robot's clock [s].
        """
        zmp, sides = self.topics.zmp, walk.phase(now).sides
        if zmp is None or walk.phase(zmp[0]).sides != sides:
            return math.nan
        corners = (self.model.feet[side].corners((*soles.foot(side)[:2], 0.0),
                                                 soles.foot(side).yaw) for side in sides)
        return float(polygon_margin(zmp[1], support_polygon(*corners)))

    def _on_tf(self, message: TFMessage) -> None:
        heard = base_pose(message, "base_link")
        if heard is not None:
            self._base = heard[0], self.turned(heard[1])
