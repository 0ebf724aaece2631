"""`ros2 action send_goal`."""

from __future__ import annotations

import argparse
from typing import Any

import yaml
from action_msgs.msg import GoalStatus
from rclpy.action import ActionClient
from rclpy.node import Node

from ros2_embedded.cli import interfaces
from ros2_embedded.cli.command_node import PREFIX, await_peer, bare_node, spin_until
from ros2_embedded.cli.common import CliError, flag, given_values, option, values_options
from ros2_embedded.message_text import to_yaml
from ros2_embedded.message_values import fill

_STATUSES = {
    GoalStatus.STATUS_ACCEPTED: "ACCEPTED",
    GoalStatus.STATUS_EXECUTING: "EXECUTING",
    GoalStatus.STATUS_CANCELING: "CANCELING",
    GoalStatus.STATUS_SUCCEEDED: "SUCCEEDED",
    GoalStatus.STATUS_CANCELED: "CANCELED",
    GoalStatus.STATUS_ABORTED: "ABORTED",
}


OPTIONS = (
    option("action_name", help="Name of the ROS action (e.g. '/fibonacci')"),
    option("action_type",
           help="Type of the ROS action (e.g. 'example_interfaces/action/Fibonacci')"),
    values_options("goal", "Goal request values in YAML format (e.g. '{order: 10}')"),
    flag("-f", "--feedback", text="Echo feedback messages for the goal"),
)  # fmt: skip


def _print_feedback(message: Any) -> None:
    print(f"Feedback:\n    {to_yaml(message.feedback)}")


def send_goal(options: argparse.Namespace) -> str | None:
    """Sends the goal and waits for its result; Ctrl-C cancels it. Returns what went wrong."""
    kind = interfaces.find(options.action_type, "action", "The passed action type is invalid")
    goal = kind.Goal()
    values = yaml.safe_load(given_values(options, "goal"))
    try:
        fill(goal, values)
    except Exception as error:  # whatever a value does to a field, as in ROS 2
        return f"Failed to populate message fields: {error!r}"
    with bare_node(f"{PREFIX}_send_goal_{options.action_type.replace('/', '_')}") as node:
        client = ActionClient(node, kind, options.action_name)
        print("Waiting for an action server to become available...")
        await_peer(client.wait_for_server)
        print(f"Sending goal:\n     {to_yaml(goal)}")
        feedback = _print_feedback if options.feedback else None
        handle = spin_until(node, client.send_goal_async(goal, feedback))
        if not handle.accepted:
            print("Goal was rejected.")
            return None
        try:
            _await_result(node, handle)
        except KeyboardInterrupt:
            _cancel(node, handle)
            raise
    return None


def _await_result(node: Node, handle: Any) -> None:
    print(f"Goal accepted with ID: {bytes(handle.goal_id.uuid).hex()}\n")
    response = spin_until(node, handle.get_result_async())
    print(f"Result:\n    {to_yaml(response.result)}")
    print(f"Goal finished with status: {_STATUSES.get(response.status, 'UNKNOWN')}")


def _cancel(node: Node, handle: Any) -> None:
    print("Canceling goal...")
    node.context.resume()
    response = spin_until(node, handle.cancel_goal_async())
    if not response.goals_canceling:
        raise CliError("Failed to cancel goal")
    print("Goal canceled.")
