"""What the commands share: a node of their own, discovery, errors, tables of sub-commands."""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import rclpy
from rclpy.arguments import ArgumentError, load_yaml
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

from ros2_embedded.catalogue import full_name
from ros2_embedded.message_modules import interface_class
from ros2_embedded.naming import is_hidden
from ros2_embedded.specs import InterfaceError
from ros2_embedded.yaml_messages import MessageError, fill

_POLL = 0.05
_QUIET = 0.4
_LONGEST = 5.0
"""Fast DDS tells a newcomer of its nodes with the next heartbeat, 3 s later at most [s]."""

Handler = Callable[[argparse.Namespace], int | None]


class CliError(Exception):
    """What the user is to be told; the command then ends with 1."""


@contextmanager
def command_node(use_sim_time: bool = False) -> Iterator[Node]:
    """A hidden node for the time of one command."""
    rclpy.init(args=[])
    try:
        yield Node(
            f"_ros2cli_{os.getpid()}",
            start_parameter_services=False,
            parameter_overrides=[rclpy.parameter.Parameter("use_sim_time", value=use_sim_time)],
        )
    finally:
        rclpy.try_shutdown()


def settle(node: Node, done: Callable[[], bool] = lambda: False) -> None:
    """Waits until discovery is complete and brings nothing new, or until `done`."""
    graph = node.context.graph
    start = changed = time.monotonic()
    known = None
    while not done() and time.monotonic() - start < _LONGEST:
        now = (len(graph.endpoints()), len(graph.nodes()))
        if now != known:
            known, changed = now, time.monotonic()
        if time.monotonic() - changed > _QUIET and graph.is_complete():
            return
        time.sleep(_POLL)


def interface(name: str, kind: str) -> Any:
    """Class of the interface that the user names."""
    full = full_name(name, kind)
    if full.split("/")[1] != kind:
        raise CliError(f"'{name}' is no {kind} type")
    return interface_class(full)


def filled(cls: Any, text: str | None) -> Any:
    """A message with the values that the user gives in YAML."""
    message = cls()
    fill(message, load_yaml(text) if text else None)
    return message


def define_list(parser: argparse.ArgumentParser, what: str, *, hidden: bool = True) -> None:
    """Options of a verb `list` of topics, services or actions; `hidden`: some can be."""
    parser.add_argument("-t", "--show-types", action="store_true", help="also the types")
    parser.add_argument(
        "-c", f"--count-{what}", dest="count", action="store_true", help="only their number"
    )
    parser.set_defaults(include_hidden=True)
    if hidden:
        parser.add_argument(
            f"--include-hidden-{what}",
            dest="include_hidden",
            action="store_true",
            default=False,
            help="also hidden ones",
        )


def print_list(options: argparse.Namespace, found: Sequence[tuple[str, list[str]]]) -> None:
    """Prints names, with their types or only their number as `define_list`'s options ask."""
    shown = [pair for pair in found if options.include_hidden or not is_hidden(pair[0])]
    if options.count:
        print(len(shown))
        return
    for name, types in shown:
        print(f"{name} [{', '.join(types)}]" if options.show_types else name)


def run(
    prog: str,
    description: str,
    verbs: Mapping[str, tuple[Callable[[argparse.ArgumentParser], None], Handler]],
    arguments: Sequence[str],
) -> int:
    """Parses a command with its verbs, runs one, and turns errors into messages."""
    parser = argparse.ArgumentParser(prog=f"ros2 {prog}", description=description)
    subparsers = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    for name, (define, handler) in verbs.items():
        text = (handler.__doc__ or "").splitlines()[0]
        sub = subparsers.add_parser(name, help=text, description=text)
        define(sub)
        sub.set_defaults(handler=handler)
    return guarded(parser.parse_args(arguments))


def guarded(options: argparse.Namespace) -> int:
    """Runs the chosen handler; errors of the user's become messages and exit codes."""
    try:
        return int(options.handler(options) or 0)
    except (CliError, InterfaceError, MessageError, ArgumentError, ValueError) as error:
        print(error, file=sys.stderr)
        return 1
    except ExternalShutdownException:
        return 0


def spin_until(node: Node, future: Any) -> Any:
    """Result of a future; Ctrl-C comes through."""
    rclpy.spin_until_future_complete(node, future)
    if not future.done():
        raise ExternalShutdownException
    return future.result()
