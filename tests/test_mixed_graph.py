"""Nodes of the embedded runtime and of ROS 2 in one domain; both must be at hand.

Run from the embedded runtime's environment, with ROS 2 named by a file that a shell sources:
`ROS2_SETUP=/opt/ros/jazzy/setup.bash:$PWD/ros2_ws/install/local_setup.bash` (the default).
"""

import os
import shlex
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import rclpy
from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_msgs.msg import ImpactPlan
from door_impact_msgs.srv import PlanDoorImpact
from processes import Started
from rcl_interfaces.srv import GetParameters
from rclpy.action import ActionClient
from rclpy.qos import qos_profile_sensor_data
from running_graph import Graph
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String
from std_srvs.srv import SetBool

ROOT = Path(__file__).parents[1]
PEER = str(ROOT / "embedded/tests/peer_node.py")  # runs on both
CYCLONE, FAST = "rmw_cyclonedds_cpp", "rmw_fastrtps_cpp"
DEFAULT = f"/opt/ros/jazzy/setup.bash:{ROOT}/ros2_ws/install/local_setup.bash"
SETUP = os.environ.get("ROS2_SETUP", DEFAULT).split(":")

pytestmark = [
    pytest.mark.skipif("ros2_embedded" not in sys.modules,
                       reason="run it from the embedded runtime's environment (make setup)"),
    pytest.mark.skipif(not all(map(os.path.isfile, SETUP)),
                       reason=f"no ROS 2 beside the embedded runtime: {' and '.join(SETUP)} are "
                       "missing; name what is to be sourced, colon-separated, in ROS2_SETUP"),
]
both = pytest.mark.parametrize("rmw", [CYCLONE, FAST])


@pytest.fixture
def ros(start_process: Callable[..., Started]) -> Callable[..., Started]:
    """Starts a command of ROS 2 with a middleware; nothing of this environment comes through."""
    wanted = ("HOME", "LANG", "ROS_DOMAIN_ID")
    clean = {name: os.environ[name] for name in wanted if name in os.environ}
    clean["PATH"] = "/usr/local/bin:/usr/bin:/bin"
    sources = " && ".join(f". {shlex.quote(name)}" for name in SETUP)

    def start(rmw: str, *command: str, reach: str = "LOCALHOST") -> Started:
        line = f"{sources} && export ROS_AUTOMATIC_DISCOVERY_RANGE={reach} && exec \"$@\""
        return start_process(["bash", "-c", line, "bash", *command],
                             {**clean, "RMW_IMPLEMENTATION": rmw})

    return start


@pytest.fixture
def embedded_peer(start_process: Callable[..., Started]) -> Started:
    """The peer on the embedded runtime."""
    return start_process([sys.executable, PEER]).wait_for_text("ready")


def sees(probe: Graph, name: str) -> bool:
    """Whether a node is in the graph."""
    return name in probe.node.get_fully_qualified_node_names()


def output(process: Started) -> str:
    """All that it wrote, when it has ended."""
    process.wait()
    return process.text()


@pytest.fixture
def probe() -> Iterator[Graph]:
    """A node of the embedded runtime, in this process."""
    rclpy.init(args=[])
    try:
        yield Graph()
    finally:
        rclpy.try_shutdown()


@both
def test_messages_cross_in_both_directions(ros: Callable[..., Started], probe: Graph,
                                           rmw: str) -> None:
    """Reliable, best-effort and latched ones arrive unchanged, and ours come back."""
    ros(rmw, "python3", PEER).wait_for_text("ready")
    joints = probe.last(JointState, "/joints")
    assert (joints.name, list(joints.position)) == (["a", "b"], [1.0, 2.5])
    felt: list[Imu] = []
    probe.node.create_subscription(Imu, "/imu", felt.append, qos_profile_sensor_data)
    probe.spin_until(lambda: felt, "/imu")
    assert felt[0] == Imu()
    assert probe.last(String, "/latched", latched=True).data == "kept"
    heard: list[str] = []
    probe.node.create_subscription(String, "/heard", lambda m: heard.append(m.data), 10)
    say = probe.node.create_publisher(String, "/say", 10)

    def answered() -> bool:
        say.publish(String(data="Grüße"))
        return bool(heard)

    probe.spin_until(answered, "the echo")
    assert set(heard) == {"Grüße"}


@both
def test_the_graph_shows_nodes_of_ros(ros: Callable[..., Started], probe: Graph, rmw: str) -> None:
    """Its name, its endpoints' types and their hashes; and it goes when its process ends."""
    from ros2_embedded.typehash import type_hash

    for _ in range(2):  # started again, it is found again
        peer = ros(rmw, "python3", PEER).wait_for_text("ready")
        probe.spin_until(lambda: sees(probe, "/peer"), "the node")
        published = probe.node.get_publisher_names_and_types_by_node("peer", "/")
        assert ("/joints", ["sensor_msgs/msg/JointState"]) in published
        (joints,) = probe.node.get_publishers_info_by_topic("/joints")
        assert str(joints.topic_type_hash) == type_hash("sensor_msgs/msg/JointState")
        peer.signal_group(signal.SIGINT)
        peer.wait()
        probe.spin_until(lambda: not sees(probe, "/peer"), "the end of the node")


def test_services_actions_and_parameters_of_ros(ros: Callable[..., Started], probe: Graph) -> None:
    """With rmw_cyclonedds_cpp a node here calls them, follows a goal and cancels one."""
    ros(CYCLONE, "python3", PEER).wait_for_text("ready")
    assert not probe.call(SetBool, "/peer/flip", data=True).success
    assert probe.call(SetBool, "/peer/flip", data=False).success
    (gain,) = probe.call(GetParameters, "/peer/get_parameters", names=["gain"]).values
    assert gain.double_value == 1.5
    client = ActionClient(probe.node, ExecuteDoorImpact, "/push")
    probe.spin_until(client.server_is_ready, "the action")
    feedback: list[str] = []

    def send(plan: str) -> Any:
        goal = ExecuteDoorImpact.Goal(plan_id=plan)
        return probe.result(client.send_goal_async(
            goal, lambda message: feedback.append(message.feedback.phase)))

    assert probe.result(send("quick").get_result_async()).result.peak_angle == 0.4
    assert feedback[-1] == "3"
    handle = send("long")
    assert len(probe.result(handle.cancel_goal_async()).goals_canceling) == 1
    assert probe.result(handle.get_result_async()).result.message == "cancelled"
    assert not send("refuse").accepted


def test_the_planner_of_ros_answers(ros: Callable[..., Started], probe: Graph) -> None:
    """Its plan comes as a reply, and with all its trajectories from the latched topic."""
    ros(CYCLONE, "ros2", "run", "impact_planner", "impact_planner", "--ros-args",
        "-p", "door:=paper")
    answer = probe.call(PlanDoorImpact, "/plan_door_impact", desired_opening_angle=0.4)
    assert answer.success, answer.message
    plan = probe.last(ImpactPlan, "/door_impact_plan", latched=True)
    assert plan.plan_id == answer.plan.plan_id
    assert plan.phases
    for phase in plan.phases:
        points = phase.trajectory.points
        assert {len(point.positions) for point in points} == {len(phase.trajectory.joint_names)}


@both
@pytest.mark.usefixtures("embedded_peer")
def test_ros_hears_embedded_nodes(ros: Callable[..., Started], rmw: str) -> None:
    """`ros2 topic` knows type, hash and node, and prints what comes."""
    echo = ("ros2", "topic", "echo", "--no-daemon", "--spin-time", "2", "--once")
    assert "- 2.5" in output(ros(rmw, *echo, "/joints"))
    assert "data: kept" in output(ros(rmw, *echo, "/latched"))
    info = output(ros(rmw, "ros2", "topic", "info", "-v", "--no-daemon", "--spin-time", "4",
                      "/joints"))
    assert "Node name: peer" in info
    assert "Topic type hash: RIHS01_a13ee3a3" in info
    assert "Failed to parse type hash" not in info


@both
@pytest.mark.usefixtures("embedded_peer")
def test_ros_finds_embedded_nodes_without_settings(ros: Callable[..., Started], rmw: str) -> None:
    """ROS 2's own discovery range is the subnet: it finds this machine's nodes all the same."""
    listing = ("ros2", "node", "list", "--no-daemon", "--spin-time", "6")
    assert "/peer" in output(ros(rmw, *listing, reach="SUBNET"))


@pytest.mark.usefixtures("embedded_peer")
def test_ros_calls_embedded_nodes(ros: Callable[..., Started]) -> None:
    """With rmw_cyclonedds_cpp: services, parameters and actions."""
    flip = ("ros2", "service", "call", "/peer/flip", "std_srvs/srv/SetBool", "{data: false}")
    assert "success=True" in output(ros(CYCLONE, *flip))
    gain = ("--no-daemon", "--spin-time", "2", "/peer", "gain")
    assert "successful" in output(ros(CYCLONE, "ros2", "param", "set", *gain, "2.5"))
    assert "2.5" in output(ros(CYCLONE, "ros2", "param", "get", *gain))
    push = output(ros(CYCLONE, "ros2", "action", "send_goal", "--feedback", "/push",
                      "door_impact_msgs/action/ExecuteDoorImpact", "{plan_id: quick}"))
    assert "phase: '3'" in push
    assert "SUCCEEDED" in push


def test_a_caller_with_fast_dds_is_warned_of_once(ros: Callable[..., Started], probe: Graph,
                                                  embedded_peer: Started) -> None:
    """Two calls that get no answer, one warning, and the service still answers others."""
    for _ in range(2):
        ros(FAST, "ros2", "service", "call", "/peer/flip", "std_srvs/srv/SetBool",
            "{}").wait_for_text("making request")
    embedded_peer.wait_for_text("uses rmw_fastrtps_cpp: its calls of /peer/flip cannot be answered")
    probe.spin_until(lambda: sum("_ros2cli_" in name for name in probe.node.get_node_names()) > 1,
                      "both callers")
    assert probe.call(SetBool, "/peer/flip", data=False).success
    assert embedded_peer.text().count("uses rmw_fastrtps_cpp") == 1


def test_a_server_with_fast_dds_is_never_ready(ros: Callable[..., Started], probe: Graph,
                                               capfd: pytest.CaptureFixture[str]) -> None:
    """The wait for it is explained by name, and no request goes out that it would misread."""
    ros(FAST, "python3", PEER).wait_for_text("ready")
    client = probe.node.create_client(SetBool, "/peer/flip")
    text = ""

    def warned() -> bool:
        nonlocal text
        text += capfd.readouterr().err
        return "/peer uses rmw_fastrtps_cpp: /peer/flip cannot be called from here" in text

    probe.spin_until(warned, "the warning")
    assert not client.service_is_ready()
