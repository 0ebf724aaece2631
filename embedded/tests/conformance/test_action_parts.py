"""Actions: topics, callbacks, the graph, blocking calls."""

from typing import Any

import pytest
from action_msgs.msg import GoalStatus, GoalStatusArray
from door_impact_msgs.action import ExecuteDoorImpact
from goals import (
    CANCELED,
    EXECUTING,
    SUCCEEDED,
    Action,
    Feedback,
    Goal,
    Held,
    Result,
    fresh_name,
    key,
    succeed,
)
from rclpy.action import (
    ActionClient,
    ActionServer,
    CancelResponse,
    GoalResponse,
    get_action_client_names_and_types_by_node,
    get_action_names_and_types,
    get_action_server_names_and_types_by_node,
)
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.task import Future
from spinning import make, spin_until
from std_msgs.msg import String
from unique_identifier_msgs.msg import UUID


def test_states_are_published(executor: SingleThreadedExecutor) -> None:
    """On a latched topic, all goals in one message; the client's handle follows it."""
    held = Held()
    action = held.action(executor)
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    lists: list[Any] = []
    assert ExecuteDoorImpact.Impl.GoalStatusMessage is GoalStatusArray
    action.node.create_subscription(
        GoalStatusArray, f"{action.name}/_action/status", lists.append, latched
    )
    first, second = action.send("a"), action.send("b")
    assert spin_until(executor, lambda: lists and len(lists[-1].status_list) == 2)
    assert spin_until(
        executor, lambda: [s.status for s in lists[-1].status_list] == [EXECUTING] * 2
    )
    assert {key(s.goal_info) for s in lists[-1].status_list} == {key(first), key(second)}
    assert spin_until(executor, lambda: first.status == second.status == EXECUTING)
    action.cancel(first)
    held.gates["a"].set_result(None)
    executor.wake()
    assert spin_until(executor, lambda: first.status == CANCELED)
    assert second.status == EXECUTING


def test_a_result_is_kept_for_a_time(executor: SingleThreadedExecutor) -> None:
    """result_timeout=0: after the end the goal is unknown."""
    done: list[bool] = []
    action = Action(executor, lambda goal: done.append(True) or succeed(goal), result_timeout=0)
    handle = action.send()
    assert spin_until(executor, lambda: done)
    for _ in range(5):
        executor.spin_once(timeout_sec=0.01)
    assert action.end(handle).status == GoalStatus.STATUS_UNKNOWN


def test_callbacks_may_be_replaced_and_be_coroutines(executor: SingleThreadedExecutor) -> None:
    """None brings the default back, except for the one that executes."""
    log: list[str] = []

    async def decide(_: Any) -> GoalResponse:
        log.append("goal")
        return GoalResponse.ACCEPT

    async def accept(handle: Any) -> None:
        log.append("accepted")
        handle.execute()

    async def cancel(_: Any) -> CancelResponse:
        log.append("cancel")
        return CancelResponse.ACCEPT

    async def feedback(_: Any) -> None:
        log.append("feedback")

    async def execute(handle: Any) -> Any:
        log.append("execute")
        handle.publish_feedback(Feedback())
        await gate
        handle.canceled()
        return Result()

    action, gate = Action(executor), Future()
    server = action.server
    server.register_goal_callback(decide)
    server.register_handle_accepted_callback(accept)
    server.register_cancel_callback(cancel)
    server.register_execute_callback(execute)
    handle = action.send(feedback_callback=feedback)
    assert spin_until(executor, lambda: "feedback" in log)
    assert action.cancel(handle)[1] == [key(handle)]
    gate.set_result(None)
    executor.wake()
    assert action.end(handle).status == CANCELED
    assert log == ["goal", "accepted", "execute", "feedback", "cancel"]
    server.register_goal_callback(None)
    server.register_handle_accepted_callback(None)
    server.register_cancel_callback(None)
    server.register_execute_callback(succeed)
    assert action.end(action.send("x")).result.message == "x"
    assert log.count("goal") == 1
    for wrong in (None, 1):
        with pytest.raises(TypeError):
            server.register_execute_callback(wrong)


def test_only_goals_can_be_sent(executor: SingleThreadedExecutor) -> None:
    """And only handles of goals be cancelled or asked; a handle names its goal."""
    action = Action(executor)
    for wrong in (None, Goal, Result(), String()):
        with pytest.raises(TypeError):
            action.client.send_goal_async(wrong)
        with pytest.raises(TypeError):
            action.client.send_goal(wrong)
    handle = action.send()
    twin = type(handle)(action.client, handle.goal_id, None)
    assert handle == twin
    assert "accepted=True" in repr(handle)
    # Another in each byte: ROS 2 takes ids for equal that have one in common.
    other = UUID(uuid=[255 - byte for byte in key(handle)])
    assert handle != type(handle)(action.client, other, None)


def test_without_a_server_nothing_is_ready(executor: SingleThreadedExecutor) -> None:
    """With one it is, until the server is destroyed; the name is free then."""
    name, node = fresh_name(), make(executor)
    client = ActionClient(node, ExecuteDoorImpact, name)
    assert not client.server_is_ready()
    assert not client.wait_for_server(0.01)
    assert not client.wait_for_server(timeout_sec=0.0)
    server = ActionServer(node, ExecuteDoorImpact, name, succeed)
    assert client.wait_for_server(20.0)
    assert client.wait_for_server()
    server.destroy()
    assert spin_until(executor, lambda: not client.server_is_ready())
    ActionServer(node, ExecuteDoorImpact, name, succeed)
    assert spin_until(executor, client.server_is_ready)
    client.destroy()


def test_actions_are_in_the_graph(executor: SingleThreadedExecutor) -> None:
    """By name and type, in all and by node; their parts are hidden from the node's lists."""
    server_node, client_node = make(executor, "serves"), make(executor, "asks")
    name = fresh_name()
    server = ActionServer(server_node, ExecuteDoorImpact, name, succeed)
    client = ActionClient(client_node, ExecuteDoorImpact, name)
    assert spin_until(executor, client.server_is_ready)
    expected = (f"/{name}", ["door_impact_msgs/action/ExecuteDoorImpact"])
    assert spin_until(executor, lambda: expected in get_action_names_and_types(client_node))
    servers = get_action_server_names_and_types_by_node
    clients = get_action_client_names_and_types_by_node
    assert spin_until(executor, lambda: expected in servers(client_node, "serves", "/"))
    assert spin_until(executor, lambda: expected in clients(server_node, "asks", "/"))
    assert not get_action_server_names_and_types_by_node(server_node, "asks", "/")
    assert server in list(server_node.waitables)
    assert client in list(client_node.waitables)
    assert not any("_action" in s.service_name for s in server_node.services)
    server.destroy()
    client.destroy()
    assert server not in list(server_node.waitables)
    assert client not in list(client_node.waitables)


def test_blocking_calls_work_beside_a_thread_that_spins(executor: SingleThreadedExecutor) -> None:
    """send_goal, get_result and cancel_goal of a client, in a callback of a pool."""
    pool, out = MultiThreadedExecutor(4), []
    held = Held()
    action = held.action(pool)
    group = ReentrantCallbackGroup()

    def ask() -> None:
        handle = sent.result()
        canceled = handle.cancel_goal()
        held.gates["a"].set_result(None)
        pool.wake()
        out.append((len(canceled.goals_canceling), handle.get_result().status))

    sent = action.client.send_goal_async(Goal(plan_id="a"))
    assert spin_until(pool, lambda: sent.done() and "a" in held.gates)
    action.node.create_guard_condition(ask, group).trigger()
    assert spin_until(pool, lambda: out == [(1, CANCELED)])
    action.server.register_execute_callback(succeed)
    whole: list[Any] = []
    guard = action.node.create_guard_condition(
        lambda: whole.append(action.client.send_goal(Goal(plan_id="b"))), group
    )
    guard.trigger()
    assert spin_until(pool, lambda: whole)
    assert (whole[0].status, whole[0].result.message) == (SUCCEEDED, "b")
    pool.shutdown()


def test_a_server_must_be_able_to_execute(executor: SingleThreadedExecutor) -> None:
    """What cannot be called is a TypeError at once."""
    with pytest.raises(TypeError):
        ActionServer(Node("tester"), ExecuteDoorImpact, "push", None)
