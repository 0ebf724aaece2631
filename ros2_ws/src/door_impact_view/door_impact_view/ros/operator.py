"""Orders of the page to services and to the action, and their answers back."""

from __future__ import annotations

import time
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Any

from door_impact_common.node import GuardedNode
from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_msgs.srv import IdentifyCloser, PlanDoorImpact, PushDoor
from rclpy.action import ActionClient
from std_srvs.srv import Trigger

from door_impact_view.live.orders import (
    Answer,
    Identify,
    Order,
    Plan,
    Push,
    Reply,
    Reset,
    Run,
    Stop,
)

PATIENCE = 120.0  # time after which a service's answer is no longer waited for [s]


@dataclass(frozen=True)
class _Pending:
    """A request whose answer is awaited until a time on the steady clock [s]."""

    future: Any
    client: Any
    reply: Reply
    until: float


class Operator:
    """Carries out the orders of the page.

    `give` may be called by any thread; everything else happens in the node's own thread.

    Args:
        node: The node.
        patience: How long a service's answer is awaited [s].

    Attributes:
        phase: What the motion that the page started is doing; empty if there is none.
    """

    def __init__(self, node: GuardedNode, patience: float = PATIENCE) -> None:
        self._patience = patience
        self._orders: SimpleQueue[tuple[Order, Reply]] = SimpleQueue()
        self._pending: list[_Pending] = []
        self._push = node.create_client(PushDoor, "/sim/push_door")
        self._identify = node.create_client(IdentifyCloser, "/identify_closer")
        self._plan = node.create_client(PlanDoorImpact, "/plan_door_impact")
        self._stop = node.create_client(Trigger, "/stop")
        self._reset = node.create_client(Trigger, "/sim/reset")
        self._execute = ActionClient(node, ExecuteDoorImpact, "/execute_door_impact")
        self.phase = ""

    def give(self, order: Order, reply: Reply) -> None:
        """Take an order; `work` carries it out."""
        self._orders.put((order, reply))

    def work(self) -> None:
        """Carry out new orders, and answer those whose answer has come or is overdue."""
        while True:
            try:
                order, reply = self._orders.get_nowait()
            except Empty:
                break
            self._carry_out(order, reply)
        now = time.monotonic()
        waiting = []
        for item in self._pending:
            if item.future.done():
                item.reply(_answer(item))
            elif now > item.until:
                item.client.remove_pending_request(item.future)
                item.reply(Answer(False, f"The service {item.client.srv_name} did not answer "
                                         f"within {self._patience:.0f} s."))
            else:
                waiting.append(item)
        self._pending = waiting

    def _carry_out(self, order: Order, reply: Reply) -> None:
        match order:
            case Push():
                self._call(self._push, PushDoor.Request(impulse=order.impulse), reply)
            case Identify():
                self._call(self._identify, IdentifyCloser.Request(), reply)
            case Plan():
                request = PlanDoorImpact.Request(
                    desired_opening_angle=order.angle, run_up=order.run_up, ending=order.ending)
                self._call(self._plan, request, reply)
            case Stop():
                self._call(self._stop, Trigger.Request(), reply)
            case Reset():
                self._call(self._reset, Trigger.Request(), reply)
            case Run():
                self._run(reply)

    def _call(self, client: Any, request: Any, reply: Reply) -> None:
        if not client.service_is_ready():
            reply(Answer(False, f"The service {client.srv_name} is not there: no node that serves "
                                "it is running."))
            return
        future = client.call_async(request)
        until = time.monotonic() + self._patience
        self._pending.append(_Pending(future, client, reply, until))

    def _run(self, reply: Reply) -> None:
        if not self._execute.server_is_ready():
            reply(Answer(False, "The action /execute_door_impact is not there: no node that "
                                "serves it is running."))
            return

        def accepted(future: Any) -> None:
            handle = future.result()
            if not handle.accepted:
                reply(Answer(False, "The executor refused the goal: another motion is running, "
                                    "or it has been stopped."))
                return
            handle.get_result_async().add_done_callback(ended)

        def ended(future: Any) -> None:
            self.phase = ""
            reply(_outcome(future.result().result))

        sent = self._execute.send_goal_async(
            ExecuteDoorImpact.Goal(), feedback_callback=self._on_feedback)
        sent.add_done_callback(accepted)

    def _on_feedback(self, message: Any) -> None:
        feedback = message.feedback
        self.phase = f"{feedback.phase}, {100.0 * feedback.progress:.0f} %"


def _answer(item: _Pending) -> Answer:
    """Return the answer of a request that is done."""
    try:
        return _outcome(item.future.result())
    except Exception as error:  # the middleware's own
        return Answer(False, f"The service {item.client.srv_name} failed: {error}.")


def _outcome(response: Any) -> Answer:
    # Every answer has these fields, and its message says what was found.
    return Answer(response.success, response.message)
