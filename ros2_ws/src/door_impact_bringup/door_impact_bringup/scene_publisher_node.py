"""Node ``scene_publisher``: publish the door for viewers, and the robot for ros2_control."""

import math
import sys

from door_impact_common.node import GuardedNode, run_node
from door_impact_common.parameters import FRAME_PREFIX, Parameters
from door_model.door.config import load_door
from hrp2_description.robot import load_robot_config
from hrp2_description.ros2_control import with_tags
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from zmp_publisher.messages import transforms

from door_impact_bringup import door_scene

PARAMETERS = {
    "door": ("paper", "name of a door in door_model/doors, or a YAML file"),
    "door_distance": (
        math.nan, "distance from the origin of odom to the closed leaf's face, along -y [m]"),
    "hinge_x": (math.nan, "x of a hinge at the right in odom, -x of one at the left [m]"),
    "robot_config": ("", "robot.yaml to use instead of hrp2_description's"),
    "hardware": ("", "plugin of the robot's hardware in ros2_control: robot_description is then "
                 "published with its tags; empty: that is the driver's"),
    "world_frame": ("odom", "name of the frame in which the door stands"),
    "frame_prefix": FRAME_PREFIX,
}


class ScenePublisher(GuardedNode):
    """Publishes the leaf's transform for each message on door_angle.

    The door's description and the place of its frame do not change; they are published once, when
    the node starts, on latched topics.

    Raises:
        ConfigError: There is no such door, or its file is wrong.
        SettingError: The place of the door is not given, or is no finite number.
    """

    def __init__(self) -> None:
        super().__init__("scene_publisher")
        parameters = Parameters(self, PARAMETERS)
        door = load_door(parameters.text("door"))
        self._hinge, urdf = door.hinge, door_scene.door_urdf(door)
        frame = door_scene.frame_pose(
            parameters.number("door_distance"), parameters.number("hinge_x"), self._hinge)
        world, self._base, self._leaf = (parameters.text("frame_prefix") + name for name in (
            parameters.text("world_frame"), door_scene.FRAME, door_scene.LEAF))

        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._description = self.create_publisher(String, "door_description", latched)
        self._description.publish(String(data=urdf))
        if hardware := parameters.text("hardware"):
            robot = load_robot_config(parameters.text("robot_config") or None)
            self._robot = self.create_publisher(String, "robot_description", latched)
            self._robot.publish(String(data=with_tags(robot, hardware)))
        self._static = self.create_publisher(TFMessage, "/tf_static", latched)
        stamp = self.get_clock().now().to_msg()
        self._static.publish(transforms(stamp, [(world, self._base)], [frame]))
        self._moving = self.create_publisher(TFMessage, "/tf", 100)
        self.create_subscription(JointState, "door_angle", self._on_angle, 10)

    def _on_angle(self, message: JointState) -> None:
        if self._moving.get_subscription_count() and message.position:
            leaf = door_scene.leaf_pose(message.position[0], self._hinge)
            frames = [(self._base, self._leaf)]
            self._moving.publish(transforms(message.header.stamp, frames, [leaf]))


def main(args: list[str] | None = None) -> int:
    """Run the node until it is stopped; the exit code is 1 if it cannot run."""
    return run_node(ScenePublisher, args=args)


if __name__ == "__main__":
    sys.exit(main())
