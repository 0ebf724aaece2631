"""A walker that is killed in the middle of a walk leaves the robot standing on two feet."""

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from door_impact_msgs.action import Walk
from geometry_msgs.msg import PointStamped, WrenchStamped
from processes import Started, find_ros2, parameters
from rclpy.action import ActionClient
from running_graph import Graph, graph_of, seconds
from sensor_msgs.msg import Imu, JointState
from std_srvs.srv import Trigger

pytestmark = pytest.mark.nightly("two walks in a graph of its own")

WITHIN = 2.1  # time after the last message within which the robot is at rest, and a little more [s]
ARGUMENTS = ("--ros-args", "--params-file", parameters())


@contextmanager
def node(package: str, name: str, folder: Path, *settings: str) -> Iterator[Started]:
    started = Started([find_ros2(), "run", package, name, *ARGUMENTS, *settings],
                      folder / f"{name}_{time.monotonic_ns()}.txt")
    try:
        yield started
    finally:
        started.clean_up()


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Graph, Path]]:
    """The simulated robot and its odometry."""
    folder = tmp_path_factory.mktemp("killed")
    with node("hrp2_sim_bridge", "hrp2_sim_bridge", folder) as bridge, \
            node("zmp_publisher", "zmp_publisher", folder, "-p", "use_sim_time:=true") as zmp, \
            graph_of(bridge, zmp) as graph:
        yield graph, folder


def now(graph: Graph) -> float:
    return seconds(graph.last(JointState, "/joint_states").header.stamp)


@pytest.mark.parametrize("wait", [0.4, 3.7])
def test_a_killed_walker_leaves_the_robot_standing(
        robot: tuple[Graph, Path], wait: float) -> None:
    """So long after the first feedback [s]."""
    graph, folder = robot
    assert graph.call(Trigger, "/sim/reset").success
    graph.last(PointStamped, "/zmp")
    client = ActionClient(graph.node, Walk, "/walk")
    try:
        with node("walking", "walker", folder, "-p", "use_sim_time:=true") as walker:
            graph.spin_until(client.server_is_ready, "the walker")
            goal = Walk.Goal()
            goal.goal.pose.position.x = 1.5
            feedback: list[Any] = []
            future = client.send_goal_async(goal, feedback_callback=feedback.append)
            assert graph.result(future).accepted
            graph.spin_until(lambda: feedback, "feedback")
            begin = now(graph)
            graph.listen(JointState, "/joint_states",
                         lambda heard: seconds(heard[-1].header.stamp) > begin + wait)
            walker.clean_up()
        killed = now(graph)
        rest = WITHIN if wait > 1.7 else WITHIN + 0.8
        states = graph.listen(JointState, "/joint_states",
                              lambda heard: seconds(heard[-1].header.stamp) > killed + rest + 0.5)
        # Or the next goal might be sent to the dead walker.
        graph.spin_until(lambda: not client.server_is_ready(), "the end of the dead walker")
    finally:
        client.destroy()
    late = [np.abs(each.velocity).max() for each in states
            if seconds(each.header.stamp) > killed + rest]
    assert np.median(late) < 0.1
    q = graph.last(Imu, "/imu").orientation
    assert math.acos(1.0 - 2.0 * (q.x**2 + q.y**2)) < math.radians(3.0)
    for side in ("left", "right"):
        assert graph.last(WrenchStamped, f"/{side}_foot/wrench").wrench.force.z > 100.0
