"""Pass orders of the page on to services and to actions, and their answers back."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from queue import Empty, SimpleQueue
from typing import Any

from door_impact_common.node import GuardedNode
from door_impact_msgs.action import ExecuteDoorImpact, Walk, WalkThroughDoor
from door_impact_msgs.srv import IdentifyCloser, PlanDoorImpact, PushDoor
from rclpy.action import ActionClient
from std_srvs.srv import SetBool, Trigger

from door_impact_view.live.panels import Name, Order, Reply, name_buttons

_SERVICES: dict[Name, tuple[Any, str]] = {
    "push": (PushDoor, "sim/push_door"),
    "identify": (IdentifyCloser, "identify_closer"),
    "plan": (PlanDoorImpact, "plan_door_impact"),
    "stop": (Trigger, "stop"),
    "reset": (Trigger, "sim/reset"),
    "pause": (SetBool, "sim/pause"),
    "step": (Trigger, "sim/step"),
}
ACTIONS: dict[Name, tuple[Any, str]] = {
    "hit": (ExecuteDoorImpact, "execute_door_impact"),
    "walk": (Walk, "walk"),
    "pass": (WalkThroughDoor, "walk_through_door"),
}
_NAMES = {name: service for name, (_, service) in (*_SERVICES.items(), *ACTIONS.items())}


class Operator:
    """Carries out the orders of the page.

    `give` may be called by any thread; everything else happens in the node's own thread.

    Args:
        node: The node.
    """

    def __init__(self, node: GuardedNode) -> None:
        self._orders: SimpleQueue[tuple[Order, Reply]] = SimpleQueue()
        self._clients = {name: node.create_client(kind, service)
                         for name, (kind, service) in _SERVICES.items()}
        self._actions = {name: ActionClient(node, kind, action)
                         for name, (kind, action) in ACTIONS.items()}

    def give(self, order: Order, reply: Reply) -> None:
        """Take an order; `work` carries it out."""
        self._orders.put((order, reply))

    def served(self) -> frozenset[Name]:
        """Return the names of the orders for which there is a node."""
        return frozenset(
            [name for name, client in self._clients.items() if client.service_is_ready()]
            + [name for name, client in self._actions.items() if client.server_is_ready()])

    def work(self) -> None:
        """Carry out new orders; their answers come from callbacks."""
        while True:
            try:
                order, reply = self._orders.get_nowait()
            except Empty:
                return
            if order.name not in self.served():
                reply(False, f"No node that serves {_NAMES[order.name]} is running.")
            elif order.name in ACTIONS:
                self._run(order, reply)
            else:
                kind, _ = _SERVICES[order.name]
                request = kind.Request(**order.fields)
                _when_done(self._clients[order.name].call_async(request), reply,
                           partial(_answer, reply))

    def _run(self, order: Order, reply: Reply) -> None:
        goal = ACTIONS[order.name][0].Goal()
        if order.name == "walk":
            place, half = goal.goal.pose, math.radians(order.fields["turn"]) / 2.0
            place.position.x, place.position.y = order.fields["x"], order.fields["y"]
            place.orientation.z, place.orientation.w = math.sin(half), math.cos(half)

        def accepted(handle: Any) -> None:
            if not handle.accepted:
                reply(False, "The goal was refused: another one is being carried out.")
                return
            _when_done(handle.get_result_async(), reply,
                       lambda answer: _answer(reply, answer.result))

        _when_done(self._actions[order.name].send_goal_async(goal), reply, accepted)


def _answer(reply: Reply, answer: Any) -> None:
    """Pass on what a node says of an order."""
    reply(answer.success, name_buttons(answer.message, _NAMES))


def _when_done(future: Any, reply: Reply, take: Callable[[Any], None]) -> None:
    """Give the result of a future to a function, or say why there is none."""

    def done(ended: Any) -> None:
        error = ended.exception()
        if error is not None:  # the middleware's own
            reply(False, f"The request failed: {error}.")
        else:
            take(ended.result())

    future.add_done_callback(done)
