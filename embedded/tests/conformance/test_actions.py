"""Actions: goals, their states, feedback, results and cancellations."""

import itertools
from typing import Any

import pytest
from action_msgs.msg import GoalInfo, GoalStatus, GoalStatusArray
from action_msgs.srv import CancelGoal
from door_impact_msgs.action import ExecuteDoorImpact
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
from spinning import make, result, spin_until
from std_msgs.msg import String
from unique_identifier_msgs.msg import UUID

ACCEPTED, EXECUTING, CANCELING, SUCCEEDED, CANCELED, ABORTED = range(1, 7)
Goal, Feedback, Result = (
    ExecuteDoorImpact.Goal, ExecuteDoorImpact.Feedback, ExecuteDoorImpact.Result,
)  # fmt: skip
_numbers = itertools.count()


def succeed(handle: Any) -> Any:
    """The shortest way to a result."""
    handle.succeed()
    return Result(message=handle.request.plan_id)


class Action:
    """A server and a client of an action with a name of its own."""

    def __init__(self, executor: Any, execute: Any = succeed, **options: Any) -> None:
        self.executor = executor
        self.name = f"push_{next(_numbers)}"
        self.node = make(executor)
        self.server = ActionServer(self.node, ExecuteDoorImpact, self.name, execute, **options)
        self.client = ActionClient(self.node, ExecuteDoorImpact, self.name)
        assert spin_until(executor, self.client.server_is_ready)

    def send(self, plan: str = "", **options: Any) -> Any:
        """The handle of a goal."""
        return result(self.executor, self.client.send_goal_async(Goal(plan_id=plan), **options))

    def end(self, handle: Any) -> Any:
        """Result of a goal."""
        return result(self.executor, handle.get_result_async())

    def cancel(self, handle: Any) -> Any:
        """Response to a cancellation: code, and ids of the goals that are being cancelled."""
        answer = result(self.executor, handle.cancel_goal_async())
        return answer.return_code, [key(info) for info in answer.goals_canceling]


def key(thing: Any) -> bytes:
    """Id of a goal."""
    return bytes(thing.goal_id.uuid)


class Held:
    """Executes goals that end when they are told to."""

    def __init__(self, **options: Any) -> None:
        self.gates: dict[str, Future] = {}
        self.handles: dict[str, Any] = {}
        self.options = {"cancel_callback": lambda _: CancelResponse.ACCEPT, **options}

    def action(self, executor: Any) -> Action:
        """The action that executes by this."""

        async def execute(handle: Any) -> Any:
            plan = handle.request.plan_id
            self.handles[plan], self.gates[plan] = handle, Future()
            await self.gates[plan]
            if handle.is_cancel_requested:
                handle.canceled()
            else:
                handle.succeed()
            return Result(message=plan)

        return Action(executor, execute, **self.options)


def test_a_goal_succeeds(executor: SingleThreadedExecutor) -> None:
    """Its request comes in, its result out, for whoever asks, and as often."""
    action = Action(executor)
    handle = action.send("one")
    assert handle.accepted
    assert (handle.stamp.sec, handle.stamp.nanosec) != (0, 0)
    for _ in range(2):
        done = action.end(handle)
        assert (done.status, done.result.message) == (SUCCEEDED, "one")


@pytest.mark.parametrize(
    ("answer", "accepted"),
    [(GoalResponse.ACCEPT, True), (GoalResponse.REJECT, False), (None, False), (True, False)],
)
def test_goals_are_accepted_or_not(
    executor: SingleThreadedExecutor, answer: Any, accepted: bool
) -> None:
    """Only GoalResponse.ACCEPT accepts; the callback gets the goal."""
    goals: list[Any] = []

    def decide(goal: Any) -> Any:
        goals.append(goal.plan_id)
        return answer

    action = Action(executor, goal_callback=decide)
    handle = action.send("plan")
    assert goals == ["plan"]
    assert handle.accepted is accepted
    if not accepted:
        assert action.end(handle).status == GoalStatus.STATUS_UNKNOWN


def test_an_error_aborts_a_goal(
    executor: SingleThreadedExecutor, capfd: pytest.CaptureFixture[str]
) -> None:
    """It is logged, not raised; a goal that is left as it is is aborted too, with its result."""

    def execute(handle: Any) -> Any:
        if handle.request.plan_id == "fail":
            raise ZeroDivisionError("as asked")
        if handle.request.plan_id == "abort":
            handle.abort()
        return Result(message="left")

    action = Action(executor, execute)
    for plan, message in (("fail", ""), ("abort", "left"), ("leave", "left")):
        done = action.end(action.send(plan))
        assert (done.status, done.result.message) == (ABORTED, message)
    told = capfd.readouterr().err
    assert "Error raised in execute callback: as asked" in told
    assert "ZeroDivisionError" in told
    assert told.count("Goal state not set, assuming aborted") == 2


def test_feedback_comes_in_order(executor: SingleThreadedExecutor) -> None:
    """To the goal's callback only; another message is a TypeError."""

    async def execute(handle: Any) -> Any:
        for wrong in (None, String(), Result()):
            with pytest.raises(TypeError):
                handle.publish_feedback(wrong)
        for step in "abc":
            handle.publish_feedback(Feedback(phase=step))
        await gate
        handle.succeed()
        return Result()

    action, gate, got, other = Action(executor, execute), Future(), [], []
    idle = action.send(feedback_callback=other.append)
    handle = action.send(feedback_callback=got.append)
    assert spin_until(executor, lambda: len(got) == len(other) == 3)
    assert [message.feedback.phase for message in got] == ["a", "b", "c"]
    assert {key(message) for message in got} == {key(handle)}
    assert {key(message) for message in other} == {key(idle)}
    gate.set_result(None)
    executor.wake()
    assert action.end(handle).status == SUCCEEDED


def test_a_cancellation_may_be_granted(executor: SingleThreadedExecutor) -> None:
    """The goal learns of it and ends itself; asked again, or after the end, it is too late."""
    held = Held()
    action = held.action(executor)
    handle = action.send("a")
    assert spin_until(executor, lambda: "a" in held.handles)
    goal = held.handles["a"]
    assert (goal.status, goal.is_active, goal.is_cancel_requested) == (EXECUTING, True, False)
    assert action.cancel(handle) == (CancelGoal.Response.ERROR_NONE, [key(handle)])
    assert (goal.status, goal.is_cancel_requested) == (CANCELING, True)
    assert action.cancel(handle) == (CancelGoal.Response.ERROR_GOAL_TERMINATED, [])
    held.gates["a"].set_result(None)
    executor.wake()
    done = action.end(handle)
    assert (done.status, done.result.message) == (CANCELED, "a")
    assert not goal.is_active
    assert action.cancel(handle) == (CancelGoal.Response.ERROR_GOAL_TERMINATED, [])


@pytest.mark.parametrize("answer", [CancelResponse.REJECT, None])
def test_a_cancellation_may_be_rejected(executor: SingleThreadedExecutor, answer: Any) -> None:
    """The goal goes on; the callback gets its handle. Rejecting is what happens by default."""
    asked: list[Any] = []
    options = {} if answer is None else {"cancel_callback": lambda h: asked.append(h) or answer}
    held = Held()
    held.options = options
    action = held.action(executor)
    handle = action.send("a")
    assert spin_until(executor, lambda: "a" in held.handles)
    assert action.cancel(handle) == (CancelGoal.Response.ERROR_NONE, [])
    assert asked == ([held.handles["a"]] if options else [])
    assert held.handles["a"].status == EXECUTING
    held.gates["a"].set_result(None)
    executor.wake()
    assert action.end(handle).status == SUCCEEDED


def cancel_request(action: Action, **goal_info: Any) -> tuple[int, set[bytes]]:
    """Asks the service of an action to cancel by id or time."""
    client = action.node.create_client(CancelGoal, f"{action.name}/_action/cancel_goal")
    assert spin_until(action.executor, client.service_is_ready)
    request = CancelGoal.Request(goal_info=GoalInfo(**goal_info))
    answer = result(action.executor, client.call_async(request))
    return answer.return_code, {key(info) for info in answer.goals_canceling}


def test_goals_are_cancelled_by_id_time_or_all(executor: SingleThreadedExecutor) -> None:
    """As action_msgs/srv/CancelGoal says; a goal that has ended stays as it is."""
    held = Held()
    action = held.action(executor)
    first = action.send("a")
    then = action.node.get_clock().now().to_msg()
    second, third, ended = (action.send(plan) for plan in ("b", "c", "d"))
    assert spin_until(executor, lambda: len(held.handles) == 4)
    held.gates["d"].set_result(None)
    executor.wake()
    assert action.end(ended).status == SUCCEEDED
    unknown = UUID(uuid=[9] * 16)
    assert cancel_request(action, goal_id=unknown) == (
        CancelGoal.Response.ERROR_UNKNOWN_GOAL_ID,
        set(),
    )
    assert cancel_request(action, goal_id=unknown, stamp=then) == (0, {key(first)})
    assert cancel_request(action, goal_id=third.goal_id, stamp=then) == (0, {key(third)})
    assert cancel_request(action) == (0, {key(second)})
    assert cancel_request(action) == (0, set())
    assert held.handles["d"].status == SUCCEEDED


def test_an_accepted_goal_may_wait(executor: SingleThreadedExecutor) -> None:
    """Until its handle is executed, by the server's callback or by another one."""
    accepted: list[Any] = []
    action = Action(
        executor, handle_accepted_callback=accepted.append,
        cancel_callback=lambda _: CancelResponse.ACCEPT,
    )  # fmt: skip
    handles = [action.send(plan) for plan in ("a", "b", "c")]
    assert spin_until(executor, lambda: len(accepted) == 3)
    assert [goal.status for goal in accepted] == [ACCEPTED] * 3
    future = handles[0].get_result_async()
    for _ in range(3):
        executor.spin_once(timeout_sec=0.01)
    assert not future.done()
    accepted[0].execute()
    assert accepted[0].status == EXECUTING
    assert result(executor, future).result.message == "a"

    def other(handle: Any) -> Any:
        handle.abort()
        return Result(message="other")

    accepted[1].execute(other)
    assert action.end(handles[1]).result.message == "other"
    assert action.cancel(handles[2])[1] == [key(handles[2])]

    def give_up(handle: Any) -> Any:
        handle.canceled()
        return Result()

    accepted[2].execute(give_up)
    assert action.end(handles[2]).status == CANCELED


def test_states_follow_the_rules(executor: SingleThreadedExecutor) -> None:
    """A change that is not foreseen is an error and changes nothing."""
    accepted: list[Any] = []
    action = Action(executor, handle_accepted_callback=accepted.append)
    handle = action.send()
    assert spin_until(executor, lambda: accepted)
    (goal,) = accepted
    for change in (goal.succeed, goal.abort, goal.canceled):
        with pytest.raises(RuntimeError, match="state"):
            change()
    assert goal.status == ACCEPTED
    errors: list[str] = []

    def execute(goal: Any) -> Any:
        for change in (goal.execute, goal.canceled):
            with pytest.raises(RuntimeError, match="state"):
                change()
            errors.append("before")
        goal.succeed()
        for change in (goal.execute, goal.succeed, goal.abort, goal.canceled):
            with pytest.raises(RuntimeError, match="state"):
                change()
            errors.append("after")
        return Result()

    goal.execute(execute)
    assert action.end(handle).status == SUCCEEDED
    assert errors == ["before"] * 2 + ["after"] * 4


def test_several_goals_run_at_once(executor: SingleThreadedExecutor) -> None:
    """Coroutines interleave, and each goal gets its own result."""
    held = Held()
    action = held.action(executor)
    handles = {plan: action.send(plan) for plan in "abc"}
    assert spin_until(executor, lambda: len(held.handles) == 3)
    for plan in "cab":
        held.gates[plan].set_result(None)
        executor.wake()
        assert action.end(handles[plan]).result.message == plan


def test_an_id_is_used_once(executor: SingleThreadedExecutor) -> None:
    """A second goal of the same id is rejected without a question, even after the end."""
    goals: list[Any] = []
    action = Action(executor, goal_callback=lambda g: goals.append(g) or GoalResponse.ACCEPT)
    mine = UUID(uuid=list(range(16)))
    first = action.send("a", goal_uuid=mine)
    assert first.accepted
    assert key(first) == bytes(range(16))
    assert action.end(first).status == SUCCEEDED
    assert not action.send("b", goal_uuid=mine).accepted
    assert len(goals) == 1


def test_states_are_published(executor: SingleThreadedExecutor) -> None:
    """On a latched topic, all goals in one message; the client's handle follows it."""
    held = Held()
    action = held.action(executor)
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    lists: list[Any] = []
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
    assert handle != action.send()


def test_without_a_server_nothing_is_ready(executor: SingleThreadedExecutor) -> None:
    """With one it is, until the server is destroyed; the name is free then."""
    name, node = f"push_{next(_numbers)}", make(executor)
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
    name = f"push_{next(_numbers)}"
    server = ActionServer(server_node, ExecuteDoorImpact, name, succeed)
    client = ActionClient(client_node, ExecuteDoorImpact, name)
    assert spin_until(executor, client.server_is_ready)
    expected = (f"/{name}", ["door_impact_msgs/action/ExecuteDoorImpact"])
    assert spin_until(executor, lambda: expected in get_action_names_and_types(client_node))
    servers = get_action_server_names_and_types_by_node(client_node, "serves", "/")
    clients = get_action_client_names_and_types_by_node(server_node, "asks", "/")
    assert expected in servers
    assert expected in clients
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
