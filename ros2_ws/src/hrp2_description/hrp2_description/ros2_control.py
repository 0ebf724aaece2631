"""A robot's URDF with the tags by which ros2_control knows its joints and sensors."""

from __future__ import annotations

from xml.etree import ElementTree

from hrp2_description.robot import SIDES
from hrp2_description.robot_types import RobotConfig

TOPICS = "joint_state_topic_hardware_interface/JointStateTopicSystem"
MOCK = "mock_components/GenericSystem"
# The simulation's own topics; a command is sent although it hardly differs from the last one.
_PARAMETERS = {TOPICS: {
    "joint_commands_topic": "sim/joint_commands", "joint_states_topic": "sim/joint_states",
    "trigger_joint_command_threshold": "-1"}}
_WRENCH = [f"{kind}.{axis}" for kind in ("force", "torque") for axis in "xyz"]
_IMU = [*(f"orientation.{axis}" for axis in "xyzw"), *(
    f"{kind}.{axis}" for kind in ("angular_velocity", "linear_acceleration") for axis in "xyz")]


def with_tags(robot: RobotConfig, plugin: str) -> str:
    """Return the robot's URDF with a `<ros2_control>` system.

    Each joint has a position command, and its position and speed as states; the force sensors have
    six states and the IMU has ten. The simulation publishes those sensors itself.

    Args:
        robot: The robot.
        plugin: Name of the hardware component: the robot's own, `TOPICS` or `MOCK`.
    """
    root = ElementTree.fromstring(robot.urdf_path.read_text(encoding="utf-8"))
    system = ElementTree.SubElement(root, "ros2_control", name=robot.name, type="system")
    hardware = ElementTree.SubElement(system, "hardware")
    ElementTree.SubElement(hardware, "plugin").text = plugin
    for name, value in _PARAMETERS.get(plugin, {}).items():
        ElementTree.SubElement(hardware, "param", name=name).text = value
    for name in robot.joint_names:
        joint = ElementTree.SubElement(system, "joint", name=name)
        ElementTree.SubElement(joint, "command_interface", name="position")
        for state in ("position", "velocity"):
            ElementTree.SubElement(joint, "state_interface", name=state)
    for name, states in ({} if plugin == TOPICS else sensors(robot)).items():
        sensor = ElementTree.SubElement(system, "sensor", name=name)
        for state in states:
            ElementTree.SubElement(sensor, "state_interface", name=state)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def sensors(robot: RobotConfig) -> dict[str, list[str]]:
    """Return the names of the sensors, and of their states.

    No sensor has a controller's name, which ros2_control refuses.
    """
    ends = ["foot"] if robot.wrist_sensors is None else ["foot", "wrist"]
    found = {f"{side}_{end}_ft": _WRENCH for end in ends for side in SIDES}
    return found if robot.imu_frame is None else {**found, "imu_sensor": _IMU}
