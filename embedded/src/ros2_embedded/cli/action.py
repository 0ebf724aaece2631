"""`ros2 action`: list, info, send_goal."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any

from rclpy.action import ActionClient, get_action_names_and_types
from rclpy.action.names import GoalStatus, part

from ros2_embedded.cli.common import (
    CliError,
    command_node,
    define_list,
    filled,
    interface,
    print_list,
    run,
    settle,
    spin_until,
)
from ros2_embedded.yaml_messages import to_yaml


def _define_list(parser: argparse.ArgumentParser) -> None:
    define_list(parser, "actions", hidden=False)


def _list(options: argparse.Namespace) -> None:
    """Output a list of action names."""
    with command_node() as node:
        settle(node)
        actions = get_action_names_and_types(node)
    print_list(options, actions)


def _define_info(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("action_name")


def _info(options: argparse.Namespace) -> None:
    """Print information about an action."""
    with command_node() as node:
        settle(node)
        topic = part(node.resolve_topic_name(options.action_name), "feedback")
        clients, servers = node.count_subscribers(topic), node.count_publishers(topic)
    print(f"Action: {options.action_name}\nAction clients: {clients}\nAction servers: {servers}")


def _define_send_goal(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("action_name")
    parser.add_argument("action_type", help="as in door_impact_msgs/action/ExecuteDoorImpact")
    parser.add_argument("goal", nargs="?", help="fields of the goal in YAML")
    parser.add_argument("-f", "--feedback", action="store_true", help="print the feedback")


def _send_goal(options: argparse.Namespace) -> int:
    """Send an action goal."""
    kind = interface(options.action_type, "action")
    goal = filled(kind.Goal, options.goal)
    with command_node() as node:
        client = ActionClient(node, kind, options.action_name)
        print("Waiting for an action server to become available...", flush=True)
        client.wait_for_server()
        print(f"Sending goal:\n     {to_yaml(goal)}", flush=True)

        def feedback(message: Any) -> None:
            print(f"Feedback:\n    {to_yaml(message.feedback)}", flush=True)

        sent = client.send_goal_async(goal, feedback if options.feedback else None)
        handle = spin_until(node, sent)
        if not handle.accepted:
            raise CliError("Goal was rejected.")
        print(f"Goal accepted with ID: {bytes(handle.goal_id.uuid).hex()}\n", flush=True)
        response = _result_or_cancel(node, handle)
    status = GoalStatus(response.status)
    print(f"Result:\n    {to_yaml(response.result)}\nGoal finished with status: {status.name}")
    return 0 if status == GoalStatus.SUCCEEDED else 1


def _result_or_cancel(node: Any, handle: Any) -> Any:
    """Waits for the result; Ctrl-C cancels the goal, and then waits for how it ended."""
    result = handle.get_result_async()
    try:
        return spin_until(node, result)
    except KeyboardInterrupt:
        print("Canceling goal...", flush=True)
        node.context.resume()
        spin_until(node, handle.cancel_goal_async())
        return spin_until(node, result)


def main(arguments: Sequence[str]) -> int:
    """Runs `ros2 action ...`."""
    verbs = {
        "list": (_define_list, _list),
        "info": (_define_info, _info),
        "send_goal": (_define_send_goal, _send_goal),
    }
    return run("action", "Various action related commands.", verbs, arguments)
