"""The graph of nodes: the command that starts it, and whether it runs already."""

import shutil
import sys
import time
from pathlib import Path

import rclpy
import yaml
from door_impact_common.errors import DoorImpactError
from door_impact_common.files import cached
from door_impact_common.node import DISCOVERY_TIME
from door_impact_common.yaml_files import read_yaml
from humanoid_motion.robot_model import RobotModel
from impact_planner.hit.placement import bringup_parameters, configured_placement
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

NODES = ("hrp2_sim_bridge", "zmp_publisher", "door_encoder", "closer_identifier", "impact_planner",
         "motion_server", "scene_publisher")
"""Nodes that bringup.launch.yaml always starts."""


class GraphError(DoorImpactError):
    """The nodes cannot be started."""


def find_ros2() -> str:
    """Return the ros2 command beside this interpreter, or the one on the path.

    Raises:
        GraphError: The ros2 command was not found.
    """
    own = Path(sys.executable).parent / "ros2"
    command = str(own) if own.exists() else shutil.which("ros2")
    if command is None:
        raise GraphError("the ros2 command was not found: run `make setup`, or source ROS 2")
    return command


def parameters_for(robot: RobotModel, given: str) -> str:
    """Return the parameter file of the nodes: the given one, or empty for that of the bringup.

    Another robot gets a copy of that with the door where its nominal step ends.

    Raises:
        InputError: The given file cannot be read.
    """
    if given:
        read_yaml(given)
    if given or robot.config.file is None:
        return given
    parameters = bringup_parameters()
    parameters["/**"]["ros__parameters"] |= vars(configured_placement(robot))
    return str(cached("params.yaml", yaml.safe_dump(parameters)))


def launch_command() -> list[str]:
    """Return the words that start the nodes; launch arguments may follow, errors of `find_ros2`."""
    return [find_ros2(), "launch", "door_impact_bringup", "bringup.launch.yaml"]


def refuse_running_graph() -> None:
    """Check that none of the nodes is running in this domain.

    Raises:
        GraphError: Some are; the error names them.
    """
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)  # signals are the caller's
    try:
        node = Node("graph_check")
        time.sleep(DISCOVERY_TIME)
        running = sorted(set(node.get_node_names()) & {*NODES, "recorder"})
        node.destroy_node()
    finally:
        rclpy.shutdown()
    if running:
        raise GraphError(f"already running: {', '.join(running)}. Stop `make up` or the other "
                         "demonstration first, or set another ROS_DOMAIN_ID")
