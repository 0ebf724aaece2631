"""Node ``scene_publisher``: the door for viewers, as URDF and transforms."""

import math
import sys
from typing import Any

from door_impact_common.node import run_node
from door_model.door.config import load_door
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from zmp_publisher.messages import transforms

from door_impact_bringup import door_scene

PARAMETERS: dict[str, tuple[Any, str]] = {
    "door": ("paper", "name of a door in door_model/doors, or a YAML file"),
    "door_distance": (math.nan, "of the closed leaf's face from the origin of odom, to -y [m]"),
    "hinge_x": (math.nan, "x of the hinge in odom [m]"),
    "world_frame": ("odom", "in which the door stands"),
}


class ScenePublisher(Node):
    """Turns /door_angle into the leaf's transform; the rest is told once."""

    def __init__(self) -> None:
        super().__init__("scene_publisher")
        door, distance, hinge_x, world = (
            self.declare_parameter(
                name, default, ParameterDescriptor(description=text, read_only=True)).value
            for name, (default, text) in PARAMETERS.items())
        urdf = door_scene.door_urdf(load_door(door))
        frame_row = door_scene.frame_pose(distance, hinge_x)

        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._description = self.create_publisher(String, "/door_description", latched)
        self._description.publish(String(data=urdf))
        self._static = self.create_publisher(TFMessage, "/tf_static", latched)
        stamp = self.get_clock().now().to_msg()
        self._static.publish(transforms(stamp, [(world, door_scene.FRAME)], [frame_row]))
        self._moving = self.create_publisher(TFMessage, "/tf", 100)
        self.create_subscription(JointState, "/door_angle", self._on_angle, 10)

    def _on_angle(self, message: JointState) -> None:
        if self._moving.get_subscription_count() and message.position:
            row = door_scene.leaf_pose(message.position[0])
            frames = (door_scene.FRAME, door_scene.LEAF)
            self._moving.publish(transforms(message.header.stamp, [frames], [row]))


def main(args: list[str] | None = None) -> int:
    """Run the node until it is told to end."""
    return run_node(ScenePublisher, args=args)


if __name__ == "__main__":
    sys.exit(main())
