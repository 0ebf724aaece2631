"""Pass orders of the page on to services and to actions, and their answers back."""

from __future__ import annotations

from collections.abc import Callable
from queue import Empty, SimpleQueue
from typing import Any

from door_impact_common.node import GuardedNode
from door_impact_msgs.action import ExecuteDoorImpact, WalkThroughDoor
from door_impact_msgs.srv import IdentifyCloser, PlanDoorImpact, PushDoor
from rclpy.action import ActionClient
from std_srvs.srv import Trigger

from door_impact_view.live.panels import Order, Reply

_SERVICES = {
    "push": (PushDoor, "sim/push_door"),
    "identify": (IdentifyCloser, "identify_closer"),
    "plan": (PlanDoorImpact, "plan_door_impact"),
    "stop": (Trigger, "stop"),
    "reset": (Trigger, "sim/reset"),
}
_ACTIONS = {
    "run": (ExecuteDoorImpact, "execute_door_impact"),
    "pass": (WalkThroughDoor, "walk_through_door"),
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
        self._actions = {name: ActionClient(node, kind, action)
                         for name, (kind, action) in _ACTIONS.items()}
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
            if order.name in _ACTIONS:
                self._run(order.name, reply)
            else:
                self._call(order, reply)

    def _call(self, order: Order, reply: Reply) -> None:
        client = self._clients[order.name]
        if not client.service_is_ready():
            reply(False, f"The service {client.service_name} is not there: no node that serves "
                  "it is running.")
            return
        kind, _ = _SERVICES[order.name]
        _when_done(client.call_async(kind.Request(**order.fields)), reply, lambda answer: reply(
            answer.success, answer.message))

    def _run(self, name: str, reply: Reply) -> None:
        (kind, action), client = _ACTIONS[name], self._actions[name]
        if not client.server_is_ready():
            reply(False, f"The action {action} is not there: no node that serves it is running.")
            return

        def accepted(handle: Any) -> None:
            if not handle.accepted:
                reply(False, "The goal was refused: another motion is running, or it has been "
                      "stopped.")
                return
            _when_done(handle.get_result_async(), reply, ended)

        def ended(answer: Any) -> None:
            self.phase = ""
            reply(answer.result.success, answer.result.message)

        _when_done(client.send_goal_async(
            kind.Goal(), feedback_callback=self._on_feedback), reply, accepted)

    def _on_feedback(self, message: Any) -> None:
        feedback = message.feedback
        done = (f"{100.0 * feedback.progress:.0f} %" if hasattr(feedback, "progress") else
                feedback.hit_phase or f"step {feedback.step} of {feedback.steps}")
        self.phase = f"{feedback.phase}, {done}"


def _when_done(future: Any, reply: Reply, take: Callable[[Any], None]) -> None:
    """Give the result of a future to a function, or say why there is none."""

    def done(ended: Any) -> None:
        error = ended.exception()
        if error is not None:  # the middleware's own
            reply(False, f"The request failed: {error}.")
        else:
            take(ended.result())

    future.add_done_callback(done)
