"""Nodes that talk: topics, services, actions, parameters, time."""

import os
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import rclpy
from builtin_interfaces.msg import Time
from door_impact_msgs.action import ExecuteDoorImpact
from rclpy.action import ActionClient
from rclpy.exceptions import InvalidHandle
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from spinning import make, result, spin_until
from std_msgs.msg import String
from std_srvs.srv import SetBool


def test_raw_subscription_gets_the_bytes_of_each_message(executor: SingleThreadedExecutor) -> None:
    """A header of CDR in little endian, then the message, in the order of publishing."""
    node = make(executor)
    got: list[bytes] = []
    node.create_subscription(String, "text", got.append, 10, raw=True)
    publisher = node.create_publisher(String, "text", 10)
    assert spin_until(executor, publisher.get_subscription_count)
    for text in ("one", "three"):
        publisher.publish(String(data=text))
    assert spin_until(executor, lambda: len(got) == 2)
    assert got[0] == b"\0\1\0\0" b"\4\0\0\0" b"one\0"
    assert got[1].startswith(b"\0\1\0")
    assert got[1][4:14] == b"\6\0\0\0three\0"


@pytest.mark.usefixtures("peer")
def test_topics_cross_processes(executor: SingleThreadedExecutor) -> None:
    """Reliable, best-effort and latched messages arrive, and replies to ours."""
    node = make(executor)
    got: dict[str, list[Any]] = {"joints": [], "imu": [], "latched": [], "heard": []}
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    for topic, kind, qos in (
        ("joints", JointState, 10), ("imu", Imu, qos_profile_sensor_data),
        ("latched", String, latched), ("heard", String, 10),
    ):  # fmt: skip
        node.create_subscription(kind, topic, got[topic].append, qos)
    say = node.create_publisher(String, "say", 10)
    assert spin_until(executor, lambda: say.get_subscription_count() == 1)
    say.publish(String(data="Grüße"))
    assert spin_until(executor, lambda: all(got.values()))
    assert got["heard"] == [String(data="Grüße")]
    assert got["latched"] == [String(data="kept")]
    assert got["joints"][0].position.tolist() == [1.0, 2.5]


@pytest.mark.usefixtures("peer")
def test_graph_shows_the_other_process(executor: SingleThreadedExecutor) -> None:
    """Node names, topics, types and counts are right soon after discovery."""
    node = make(executor)
    assert spin_until(executor, lambda: ("peer", "/") in node.get_node_names_and_namespaces())
    assert node.get_node_names().count("tester") == 1
    assert spin_until(executor, lambda: node.count_publishers("joints") == 1)
    assert ("/joints", ["sensor_msgs/msg/JointState"]) in node.get_topic_names_and_types()
    assert ("/peer/flip", ["std_srvs/srv/SetBool"]) in node.get_service_names_and_types()
    assert node.count_subscribers("/joints") == 0


@pytest.mark.usefixtures("peer")
def test_service_answers_each_caller(executor: SingleThreadedExecutor) -> None:
    """Each call gets its own response, also when several are under way."""
    node = make(executor)
    clients = [node.create_client(SetBool, "/peer/flip") for _ in range(2)]
    assert all(client.wait_for_service(8.0) for client in clients)
    data = [True, False, False, True, False]
    futures = [c.call_async(SetBool.Request(data=d)) for d in data for c in clients]
    answers = [result(executor, future).success for future in futures]
    assert answers == [not d for d in data for _ in clients]
    assert not node.create_client(SetBool, "/nobody").wait_for_service(0.05)


@pytest.mark.usefixtures("peer")
def test_action_succeeds_fails_refuses_and_cancels(executor: SingleThreadedExecutor) -> None:
    """Goals end as succeeded, aborted, refused and cancelled; feedback comes in order."""
    client = ActionClient(make(executor), ExecuteDoorImpact, "push")
    assert client.wait_for_server(8.0)
    feedback: list[str] = []

    def send(plan: str) -> Any:
        goal = ExecuteDoorImpact.Goal(plan_id=plan)
        note = lambda m: feedback.append(m.feedback.phase)  # noqa: E731
        return result(executor, client.send_goal_async(goal, note))

    done = result(executor, send("quick").get_result_async())
    assert (done.status, done.result.success) == (4, True)
    # The first may be lost, as in ROS 2: the server's publisher may not know our reader yet.
    assert feedback
    assert feedback == ["0", "1", "2", "3"][-len(feedback) :]
    assert result(executor, send("fail").get_result_async()).status == 6
    assert not send("refuse").accepted
    handle = send("long")
    answer = result(executor, handle.cancel_goal_async())
    assert [bytes(g.goal_id.uuid) for g in answer.goals_canceling] == [bytes(handle.goal_id.uuid)]
    ended = result(executor, handle.get_result_async())
    assert (ended.status, ended.result.message) == (5, "cancelled")
    assert result(executor, handle.cancel_goal_async()).return_code == 3


def test_callback_errors_come_out_of_spin(executor: SingleThreadedExecutor) -> None:
    """What a callback or a coroutine raises, spin raises; the future keeps its own."""
    node = make(executor)

    def fail() -> None:
        raise ZeroDivisionError

    async def fail_later() -> None:
        raise KeyError("later")

    timer = node.create_timer(0.001, fail)
    with pytest.raises(ZeroDivisionError):
        spin_until(executor, lambda: False)
    timer.cancel()
    task = executor.create_task(fail_later)
    with pytest.raises(KeyError):
        executor.spin_once(timeout_sec=1.0)
    with pytest.raises(KeyError):
        task.result()


def test_destroyed_things_are_silent(executor: SingleThreadedExecutor) -> None:
    """After destruction there is no callback, and publishing is an error."""
    node = make(executor)
    got: list[Any] = []
    subscription = node.create_subscription(String, "x", got.append, 10)
    publisher = node.create_publisher(String, "x", 10)
    assert spin_until(executor, lambda: publisher.get_subscription_count() == 1)
    publisher.publish(String())
    assert node.destroy_subscription(subscription)
    assert not node.destroy_subscription(subscription)
    node.destroy_publisher(publisher)
    executor.spin_once(timeout_sec=0.05)
    assert got == []
    with pytest.raises(InvalidHandle):
        publisher.publish(String())
    with pytest.raises(TypeError):
        node.create_publisher(String, "y", 1).publish(Time())
    node.destroy_node()
    node.destroy_node()


def test_blocking_call_in_a_callback(executor: SingleThreadedExecutor) -> None:
    """With several threads a callback may wait for a service of another group."""
    pool = MultiThreadedExecutor(4)
    node = Node("multi")
    pool.add_node(node)
    group = rclpy.callback_groups.ReentrantCallbackGroup()

    def flip(request: Any, response: Any) -> Any:
        response.success = request.data
        return response

    node.create_service(SetBool, "flip", flip, callback_group=group)
    client = node.create_client(SetBool, "flip", callback_group=group)
    assert client.wait_for_service(8.0)
    answers: list[bool] = []

    def ask() -> None:
        timer.cancel()
        answers.append(client.call(SetBool.Request(data=True), timeout_sec=8.0).success)

    timer = node.create_timer(0.001, ask)
    assert spin_until(pool, lambda: bool(answers))
    assert answers == [True]
    pool.shutdown()


def test_timers_follow_simulated_time(executor: SingleThreadedExecutor) -> None:
    """With use_sim_time a timer fires by /clock: not before it runs, not twice after a jump."""
    source = make(executor, "source")
    node = make(executor, parameter_overrides=[Parameter("use_sim_time", value=True)])
    clock = source.create_publisher(Clock, "/clock", 10)
    ticks: list[int] = []
    node.create_timer(0.1, lambda: ticks.append(node.get_clock().now().nanoseconds))
    assert node.get_clock().now().nanoseconds == 0
    assert spin_until(executor, lambda: clock.get_subscription_count() == 1)

    def advance(milliseconds: int) -> None:
        nanoseconds = milliseconds * 1_000_000
        sec, nanosec = divmod(nanoseconds, 1_000_000_000)
        clock.publish(Clock(clock=Time(sec=sec, nanosec=nanosec)))
        assert spin_until(executor, lambda: node.get_clock().nanoseconds() == nanoseconds)
        executor.spin_once(timeout_sec=0.0)

    for now in (50, 99, 100, 150, 200, 950, 960):
        advance(now)
    assert [t // 1_000_000 for t in ticks] == [100, 200, 950]
    advance(10)  # a reset of the simulation
    advance(110)
    assert ticks[-1] == 110_000_000


def test_namesakes_are_warned_of(
    executor: SingleThreadedExecutor,
    start: Callable[..., "subprocess.Popen[str]"],
    capfd: pytest.CaptureFixture[str],
) -> None:
    """Both of two nodes of one name hear of each other, and the graph shows both."""
    node = make(executor, "peer")
    other = start(str(Path(__file__).parent / "peer_node.py"))
    assert spin_until(executor, lambda: node.get_node_names().count("peer") == 2)
    assert other.stdout is not None
    assert any(
        "already in the graph" in line for line, _ in zip(other.stdout, range(3), strict=False)
    )
    assert "already in the graph" in capfd.readouterr().err


def test_a_late_node_knows_every_earlier_process(
    start: Callable[..., "subprocess.Popen[str]"],
) -> None:
    """What several processes told before is heard from all of them, whoever told last."""
    program = (
        "import sys, rclpy; rclpy.init(); node = rclpy.create_node(sys.argv[1]); print('there'); "
        "rclpy.spin(node)"
    )
    names = [f"early_{number}" for number in range(5)]
    for process in [start("-c", program, name) for name in names]:
        assert process.stdout is not None
        assert process.stdout.readline() == "there\n"
    for _ in range(3):
        rclpy.init(args=[])
        try:
            executor = SingleThreadedExecutor()
            node = make(executor, "late")
            assert spin_until(executor, lambda node=node: set(names) <= set(node.get_node_names()))
        finally:
            rclpy.try_shutdown()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_end_a_spinning_node(peer: "subprocess.Popen[str]", number: signal.Signals) -> None:
    """Ctrl-C and SIGTERM come out of spin, and the process ends well."""
    os.kill(peer.pid, number)
    assert peer.wait(timeout=5) == 0
