"""What the tests of actions share: a server and a client with a name of their own."""

import itertools
from typing import Any

from door_impact_msgs.action import ExecuteDoorImpact
from rclpy.action import (
    ActionClient,
    ActionServer,
    CancelResponse,
)
from rclpy.task import Future
from spinning import make, result, spin_until

ACCEPTED, EXECUTING, CANCELING, SUCCEEDED, CANCELED, ABORTED = range(1, 7)
Goal, Feedback, Result = (
    ExecuteDoorImpact.Goal, ExecuteDoorImpact.Feedback, ExecuteDoorImpact.Result,
)  # fmt: skip
_numbers = itertools.count()


def fresh_name() -> str:
    """A name that no action of this process has had."""
    return f"push_{next(_numbers)}"


def succeed(handle: Any) -> Any:
    """The shortest way to a result."""
    handle.succeed()
    return Result(message=handle.request.plan_id)


class Action:
    """A server and a client of an action with a name of its own."""

    def __init__(self, executor: Any, execute: Any = succeed, **options: Any) -> None:
        self.executor = executor
        self.name = fresh_name()
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
