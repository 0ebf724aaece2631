"""Pass orders of the page on to services and to the action, and their answers back."""

from __future__ import annotations

from collections.abc import Callable
from queue import Empty, SimpleQueue
from typing import Any

from door_impact_common.node import GuardedNode
from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_msgs.srv import IdentifyCloser, PlanDoorImpact, PushDoor
from rclpy.action import ActionClient
from std_srvs.srv import Trigger

from door_impact_view.live.panels import Order, Reply

_SERVICES = {
    "push": (PushDoor, "/sim/push_door"),
    "identify": (IdentifyCloser, "/identify_closer"),
    "plan": (PlanDoorImpact, "/plan_door_impact"),
    "stop": (Trigger, "/stop"),
    "reset": (Trigger, "/sim/reset"),
}


class Operator:
    """Carries out the orders of the page.

    `give` may be called by any thread; everything else happens in the node's own thread.

    Args:
        node: The node.

    Attributes:
        phase: What the motion that the page started is doing; empty if there is none.
    """

    def __init__(self, node: GuardedNode) -> None:
        self._orders: SimpleQueue[tuple[Order, Reply]] = SimpleQueue()
        self._clients = {name: node.create_client(kind, service)
                         for name, (kind, service) in _SERVICES.items()}
        self._execute = ActionClient(node, ExecuteDoorImpact, "/execute_door_impact")
        self.phase = ""

    def give(self, order: Order, reply: Reply) -> None:
        """Take an order; `work` carries it out."""
        self._orders.put((order, reply))

    def work(self) -> None:
        """Carry out new orders; their answers come from callbacks."""
        while True:
            try:
                order, reply = self._orders.get_nowait()
            except Empty:
                return
            if order.name == "run":
                self._run(reply)
            else:
                self._call(order, reply)

    def _call(self, order: Order, reply: Reply) -> None:
        client = self._clients[order.name]
        if not client.service_is_ready():
            reply(False, f"The service {client.srv_name} is not there: no node that serves it is "
                  "running.")
            return
        kind, _ = _SERVICES[order.name]
        _when_done(client.call_async(kind.Request(**order.fields)), reply, lambda answer: reply(
            answer.success, answer.message))

    def _run(self, reply: Reply) -> None:
        if not self._execute.server_is_ready():
            reply(False, "The action /execute_door_impact is not there: no node that serves it is "
                  "running.")
            return

        def accepted(handle: Any) -> None:
            if not handle.accepted:
                reply(False, "The executor refused the goal: another motion is running, or it has "
                      "been stopped.")
                return
            _when_done(handle.get_result_async(), reply, ended)

        def ended(answer: Any) -> None:
            self.phase = ""
            reply(answer.result.success, answer.result.message)

        _when_done(self._execute.send_goal_async(
            ExecuteDoorImpact.Goal(), feedback_callback=self._on_feedback), reply, accepted)

    def _on_feedback(self, message: Any) -> None:
        feedback = message.feedback
        self.phase = f"{feedback.phase}, {100.0 * feedback.progress:.0f} %"


def _when_done(future: Any, reply: Reply, take: Callable[[Any], None]) -> None:
    """Give the result of a future to a function, or say why there is none."""

    def done(ended: Any) -> None:
        error = ended.exception()
        if error is not None:  # the middleware's own
            reply(False, f"The request failed: {error}.")
        else:
            take(ended.result())

    future.add_done_callback(done)
