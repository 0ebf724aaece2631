"""Simulation, odometry and walker alone, far from the origin: a walk, and a walker that dies."""

import math
import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from graph.test_walk import at, stands, to, walker
from processes import Started, find_ros2, parameters
from running_graph import Graph, graph_of
from tf2_msgs.msg import TFMessage
from walking.footsteps.footstep import Pose

pytestmark = pytest.mark.nightly("walks in a graph of its own")

START = Pose(6.0, -4.0, 2.0)
ELSEWHERE = ("-p", f"robot_start:=[{START.x}, {START.y}, {START.yaw}]")
AWAY = ("-p", "engine:=mujoco", "-p", "door_distance:=9.0", "-p", "hinge_x:=-9.0")


@contextmanager
def node(folder: Path, package: str, name: str, *settings: str) -> Iterator[Started]:
    started = Started([find_ros2(), "run", package, name, "--ros-args", "--params-file",
                       parameters(), *settings], folder / f"{name}.txt")
    try:
        yield started
    finally:
        started.clean_up()


@pytest.fixture(scope="module")
def graph(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Graph]:
    """Simulation and odometry, which begin at START."""
    folder = tmp_path_factory.mktemp("elsewhere")
    with node(folder, "hrp2_sim_bridge", "hrp2_sim_bridge", *ELSEWHERE, *AWAY) as bridge, \
            node(folder, "zmp_publisher", "zmp_publisher", *ELSEWHERE,
                 "-p", "use_sim_time:=true") as odometry, \
            graph_of(bridge, odometry) as graph:
        yield graph


@pytest.fixture
def process(tmp_path: Path) -> Iterator[Started]:
    """The walker's."""
    with node(tmp_path, "motion_execution", "motion_server", "-p", "use_sim_time:=true") as started:
        yield started


def begins_at_start(graph: Graph) -> None:
    """Wait until base_link is there in odom."""
    def there(heard: list[TFMessage]) -> bool:
        base = heard[-1].transforms[0]
        place, turn = base.transform.translation, base.transform.rotation
        yaw = math.atan2(2.0 * (turn.w * turn.z + turn.x * turn.y),
                         1.0 - 2.0 * (turn.y**2 + turn.z**2))
        return base.child_frame_id == "base_link" and (place.x, place.y, yaw) == pytest.approx(
            (START.x, START.y, START.yaw), abs=0.02)

    graph.listen(TFMessage, "/tf", there)


@pytest.mark.usefixtures("process")
def test_the_odometry_begins_at_the_start_follows_a_walk_and_begins_anew_by_a_reset(
        graph: Graph) -> None:
    begins_at_start(graph)
    goal = START.moved(0.3, 0.1, math.radians(20.0))
    with walker(graph) as walk:
        found = walk.arrive(to(goal.x, goal.y, goal.yaw)).end.result
    assert at(found.pose.pose) == pytest.approx((goal.x, goal.y, goal.yaw), abs=0.02)

    def uses_imu(messages: list[Any]) -> bool:
        return any(pair.key == "odometry" and pair.value == "soles and imu"
                   for status in messages[-1].status for pair in status.values)

    graph.listen(DiagnosticArray, "/diagnostics", uses_imu)
    graph.reset()
    begins_at_start(graph)


@pytest.mark.parametrize("step", [1, 4])
def test_a_killed_walker_leaves_the_robot_standing(
        graph: Graph, process: Started, step: int) -> None:
    graph.reset()
    goal = START.moved(1.5, 0.0, 0.0)
    with walker(graph) as walk:
        walk.begin(to(goal.x, goal.y, goal.yaw), step)
        for pid in process.family():
            os.kill(pid, signal.SIGKILL)
        stands(graph)
        # Or the next goal might be sent to the dead walker.
        graph.spin_until(lambda: not walk.client.server_is_ready(), "the end of the dead walker")
