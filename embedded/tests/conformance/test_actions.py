"""Actions: goals, their states, feedback, results and cancellations."""

from typing import Any

import pytest
from action_msgs.msg import GoalInfo, GoalStatus
from action_msgs.srv import CancelGoal
from door_impact_msgs.action import ExecuteDoorImpact
from goals import (
    ABORTED,
    ACCEPTED,
    CANCELED,
    CANCELING,
    EXECUTING,
    SUCCEEDED,
    Action,
    Feedback,
    Goal,
    Held,
    Result,
    fresh_name,
    key,
)
from rclpy.action import (
    ActionClient,
    CancelResponse,
    GoalResponse,
)
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future
from spinning import result, spin_until
from std_msgs.msg import String
from unique_identifier_msgs.msg import UUID


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


def test_feedback_comes_whatever_the_node_does_with_its_subscriptions(
    executor: SingleThreadedExecutor,
) -> None:
    """A node that overrides create_subscription takes no part in the action's own topics."""

    class Closed(Node):
        def create_subscription(self, *_: Any, **__: Any) -> Any:
            raise AssertionError("the action's subscriptions are its own")

    def execute(handle: Any) -> Any:
        handle.publish_feedback(Feedback(phase="a"))
        handle.succeed()
        return Result()

    action, node, got = Action(executor, execute), Closed(fresh_name()), []
    executor.add_node(node)
    client = ActionClient(node, ExecuteDoorImpact, action.name)
    assert spin_until(executor, client.server_is_ready)
    sent = client.send_goal_async(Goal(), feedback_callback=got.append)
    assert spin_until(executor, lambda: got and sent.done())
    node.destroy_node()


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
