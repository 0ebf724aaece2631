"""`ros2 action`: list, info and send_goal."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from action_msgs.msg import GoalStatus
from rclpy.action import (
    ActionClient,
    get_action_client_names_and_types_by_node,
    get_action_names_and_types,
    get_action_server_names_and_types_by_node,
)
from rclpy.node import Node
from rclpy.task import Future

from ros2_commands.errors import CommandError
from ros2_commands.graph import Named, add_list, bare_node, graph_node, held_interrupts, spin
from ros2_commands.messages import interface_class, message_from_yaml, to_yaml
from ros2_commands.options import Verbs, add_discovery

_STATUSES = {
    GoalStatus.STATUS_SUCCEEDED: "SUCCEEDED",
    GoalStatus.STATUS_CANCELED: "CANCELED",
    GoalStatus.STATUS_ABORTED: "ABORTED",
}


def _info(options: argparse.Namespace) -> None:
    """Print the nodes that serve an action and those that call it."""
    name = options.action_name
    with graph_node(options.spin_time) as node:
        sides = {
            "clients": _ends(node, name, get_action_client_names_and_types_by_node),
            "servers": _ends(node, name, get_action_server_names_and_types_by_node),
        }
    print(f"Action: {name}")
    for title, ends in sides.items():
        print(f"Action {title}: {len(ends)}")
        for owner, types in ends:
            print(f"    {owner} [{', '.join(types)}]" if options.show_types else f"    {owner}")


def _ends(node: Node, action: str, by_node: Callable[[Node, str, str], Named]) -> Named:
    """Return the nodes with a client, or a server, of the action, with its types."""
    wanted = node.resolve_topic_name(action)
    found = []
    for name, space in node.get_node_names_and_namespaces():
        with suppress(RuntimeError):  # it left in between
            types = dict(by_node(node, name, space)).get(wanted)
            if types:
                found.append((f"{space.rstrip('/')}/{name}", types))
    return found


def _print_feedback(message: Any) -> None:
    print(f"Feedback:\n    {to_yaml(message.feedback)}")


def _send_goal(options: argparse.Namespace) -> None:
    """Send a goal and wait for its result; Ctrl-C cancels the goal."""
    kind = interface_class(options.action_type, "action")
    goal = message_from_yaml(kind.Goal, options.goal)
    with bare_node() as node:
        client = ActionClient(node, kind, options.action_name)
        print("Waiting for an action server to become available...")
        client.wait_for_server()
        print(f"Sending goal:\n     {to_yaml(goal)}")
        feedback = _print_feedback if options.feedback else None
        try:
            with held_interrupts() as interrupts:
                _see_through(node, client.send_goal_async(goal, feedback), interrupts)
        finally:
            client.destroy()


def _see_through(node: Node, sent: Future, interrupts: list[int]) -> None:
    """Wait for what becomes of a goal that was sent; the first Ctrl-C cancels it."""
    spin(node, lambda: interrupts or sent.done())
    if not sent.done():
        raise KeyboardInterrupt
    handle = sent.result()
    if not handle.accepted:
        print("Goal was rejected.")
        return
    print(f"Goal accepted with ID: {bytes(handle.goal_id.uuid).hex()}\n")
    ended = handle.get_result_async()
    spin(node, lambda: interrupts or ended.done())
    if not ended.done():
        print("Canceling goal...")
        answer = handle.cancel_goal_async()
        spin(node, lambda: len(interrupts) > 1 or answer.done())
        if not answer.done() or not answer.result().goals_canceling:
            raise CommandError("Failed to cancel goal")
        print("Goal canceled.")
        raise KeyboardInterrupt
    response = ended.result()
    print(f"Result:\n    {to_yaml(response.result)}")
    print(f"Goal finished with status: {_STATUSES.get(response.status, 'UNKNOWN')}")


def define(parser: argparse.ArgumentParser) -> None:
    """Add the verbs to the command's parser."""
    verbs = Verbs(parser)
    add_list(verbs, "actions", get_action_names_and_types)
    info = verbs.add("info", _info)
    add_discovery(info)
    info.add_argument("action_name")
    info.add_argument("-t", "--show-types", action="store_true", help="show types as well")
    goal = verbs.add("send_goal", _send_goal)
    goal.add_argument("action_name")
    goal.add_argument("action_type")
    goal.add_argument("goal", nargs="?", default="{}", help="goal in YAML: '{order: 10}'")
    goal.add_argument("-f", "--feedback", action="store_true", help="print feedback as well")
