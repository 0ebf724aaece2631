"""`ros2 topic`: list, info, type."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from ros2_embedded.cli import topic_echo, topic_hz, topic_pub
from ros2_embedded.cli.common import CliError, command_node, define_list, print_list, run, settle


def _define_list(parser: argparse.ArgumentParser) -> None:
    define_list(parser, "topics")


def _list(options: argparse.Namespace) -> None:
    """Output a list of available topics."""
    with command_node() as node:
        settle(node)
        topics = node.get_topic_names_and_types()
    print_list(options, topics)


def _define_name(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("topic_name")


def _define_info(parser: argparse.ArgumentParser) -> None:
    _define_name(parser)
    parser.add_argument(
        "-v", "--verbose", action="store_true", help="every publisher and subscription"
    )


def _info(options: argparse.Namespace) -> None:
    """Print information about a topic."""
    with command_node() as node:
        settle(node)
        name = node.resolve_topic_name(options.topic_name)
        types = dict(node.get_topic_names_and_types()).get(name)
        if types is None:
            raise CliError(f"Unknown topic '{options.topic_name}'")
        publishers = node.get_publishers_info_by_topic(name)
        subscriptions = node.get_subscriptions_info_by_topic(name)
    end = "\n\n" if options.verbose else "\n"
    print(f"Type: {types[0] if len(types) == 1 else types}", end=end)
    for title, endpoints in (("Publisher", publishers), ("Subscription", subscriptions)):
        print(f"{title} count: {len(endpoints)}", end=end)
        for endpoint in endpoints if options.verbose else ():
            print(f"{endpoint}\n")


def _type(options: argparse.Namespace) -> None:
    """Print a topic's type."""
    with command_node() as node:
        name = node.resolve_topic_name(options.topic_name)
        settle(node, lambda: name in dict(node.get_topic_names_and_types()))
        types = dict(node.get_topic_names_and_types()).get(name)
    if types is None:
        raise CliError(f"Unknown topic '{options.topic_name}'")
    print("\n".join(types))


def main(arguments: Sequence[str]) -> int:
    """Runs `ros2 topic ...`."""
    verbs = {
        "list": (_define_list, _list),
        "info": (_define_info, _info),
        "type": (_define_name, _type),
        "echo": (topic_echo.define, topic_echo.echo),
        "hz": (topic_hz.define, topic_hz.rate),
        "pub": (topic_pub.define, topic_pub.publish),
    }
    return run("topic", "Various topic related commands.", verbs, arguments)
