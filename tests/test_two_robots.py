"""Two robots in one domain, each with its door, in namespaces: what is one's is not the other's."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from door_impact_msgs.action import Walk
from door_impact_msgs.srv import PushDoor
from geometry_msgs.msg import PointStamped
from processes import Started, find_ros2, parameters
from rclpy.action import ActionClient
from running_graph import Graph, graph_of
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage

ROBOTS = ("robot1", "robot2")
PATIENCE = "    stale_after: 20.0\n    silent_after: 60.0\n"  # of motion_server, last in the file


@pytest.fixture(scope="module")
def graph(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Graph]:
    """All nodes of both robots."""
    folder = tmp_path_factory.mktemp("two")
    patient = folder / "params.yaml"  # two simulations starve each other on a small machine
    patient.write_text(Path(parameters()).read_text() + PATIENCE)
    with ExitStack() as end:
        launched = [Started(
            [find_ros2(), "launch", "door_impact_bringup", "bringup.launch.yaml",
             f"namespace:={name}", "engine:=mujoco", f"params:={patient}"],
            folder / f"{name}.txt") for name in ROBOTS]
        for each in launched:
            end.callback(each.clean_up)
        graph = end.enter_context(graph_of(*launched))
        for name in ROBOTS:
            graph.last(PointStamped, f"/{name}/zmp")
        yield graph


def test_what_one_robot_is_told_and_does_is_not_the_others(graph: Graph) -> None:
    """Its door is pushed and a walk is planned for it; the other's door stays shut.

    The frames in /tf differ.
    """
    doors: dict[str, list[JointState]] = {name: [] for name in ROBOTS}
    frames: set[str] = set()

    def note(message: TFMessage) -> None:
        frames.update(each.header.frame_id for each in message.transforms)

    for name in ROBOTS:
        graph.node.create_subscription(JointState, f"/{name}/door_angle", doors[name].append, 1000)
    graph.node.create_subscription(TFMessage, "/tf", note, 1000)
    graph.spin_until(lambda: all(map(len, doors.values())), "both doors")
    assert graph.call(PushDoor, "/robot1/sim/push_door", impulse=5.0, duration=0.15).success
    walk = ActionClient(graph.node, Walk, "/robot1/walk")
    graph.spin_until(walk.server_is_ready, "the action")
    goal = Walk.Goal(dry_run=True)
    goal.goal.pose.position.x, goal.goal.pose.orientation.w = -0.2, 1.0
    goal.goal.header.frame_id = "robot1/odom"
    handle = graph.result(walk.send_goal_async(goal), "the goal")
    end = graph.result(handle.get_result_async(), "the end of the walk").result
    walk.destroy()
    assert end.success, end.message
    assert end.pose.header.frame_id == "robot1/odom"
    assert graph.call(Trigger, "/robot2/stop").message.startswith("nothing is being executed")
    graph.spin_until(lambda: max(each.position[0] for each in doors["robot1"]) > 0.02, "the push")
    opened, shut = (max(each.position[0] for each in doors[name]) for name in ROBOTS)
    assert opened > 0.02
    assert shut == pytest.approx(0.0, abs=1e-3)
    assert {f"{name}/odom" for name in ROBOTS} <= frames
    assert "odom" not in frames
