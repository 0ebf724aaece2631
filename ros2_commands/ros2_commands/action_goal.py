"""`ros2 action send_goal`."""

from __future__ import annotations

import argparse
from typing import Any

from action_msgs.msg import GoalStatus
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.task import Future

from ros2_commands.errors import CommandError
from ros2_commands.graph import bare_node, held_interrupts, spin
from ros2_commands.interface_classes import interface_class
from ros2_commands.message_text import to_yaml
from ros2_commands.message_values import message_from_yaml

_STATUSES = {
    GoalStatus.STATUS_SUCCEEDED: "SUCCEEDED",
    GoalStatus.STATUS_CANCELED: "CANCELED",
    GoalStatus.STATUS_ABORTED: "ABORTED",
}


def define(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument("action_name")
    parser.add_argument("action_type")
    parser.add_argument("goal", nargs="?", default="{}", help="goal in YAML: '{order: 10}'")
    parser.add_argument("-f", "--feedback", action="store_true", help="print feedback as well")


def _print_feedback(message: Any) -> None:
    print(f"Feedback:\n    {to_yaml(message.feedback)}")


def send_goal(options: argparse.Namespace) -> None:
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
