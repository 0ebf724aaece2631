"""Make the node of a command, wait for discovery and answers, and list what the graph has."""

from __future__ import annotations

import argparse
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any

import rclpy
from rclpy.exceptions import NameValidationException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from rclpy.topic_or_service_is_hidden import topic_or_service_is_hidden

from ros2_commands.errors import CommandError
from ros2_commands.options import Verbs, add_discovery

Named = Sequence[tuple[str, list[str]]]
"""Names of topics, services or actions, each with its types."""

_POLL = 0.1  # [s]
_QUIET = 0.5  # discovery goes on as long as there was news in this time [s]
_LONGEST = 5.0  # [s]
_WAKE = 0.1  # a wait within rclpy notices Ctrl-C only when it ends [s]


def _end(*_: Any) -> None:
    sys.exit(signal.SIGTERM)


@contextmanager
def bare_node() -> Iterator[Node]:
    """Yield a hidden node that knows nothing yet; Ctrl-C and SIGTERM are exceptions in it.

    Raises:
        CommandError: A name that the user gave is not valid.
    """
    signal.signal(signal.SIGTERM, _end)
    # rclpy's own handlers would end its context before a goal could be cancelled.
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = Node(
            f"_ros2cli_{os.getpid()}",
            enable_rosout=False,
            start_parameter_services=False,
            parameter_overrides=[Parameter("start_type_description_service", value=False)],
        )
        yield node
        node.destroy_node()
    except (NameValidationException, ValueError) as error:
        raise CommandError(str(error)) from error
    finally:
        rclpy.try_shutdown()


@contextmanager
def graph_node(spin_time: float, done: Callable[[Node], Any] | None = None) -> Iterator[Node]:
    """Yield a node that knows the graph, or at least as much of it as is `done`.

    Args:
        spin_time: Shortest wait for discovery without `done` [s].
        done: Tried now and then: whether nothing more is needed. It is waited for in any case.
    """
    with bare_node() as node:
        start = changed = time.monotonic()
        shortest = _LONGEST if done else spin_time
        known: Any = None
        while not (done and done(node)):
            now = time.monotonic()
            if (snapshot := _snapshot(node)) != known:
                known, changed = snapshot, now
            quiet = now - changed > _QUIET or now - start > _LONGEST
            if quiet and now - start > shortest:
                break
            time.sleep(_POLL)
        yield node


def _snapshot(node: Node) -> tuple[Any, ...]:
    topics = node.get_topic_names_and_types()
    ends = [(name, node.count_publishers(name), node.count_subscribers(name)) for name, _ in topics]
    return node.get_node_names_and_namespaces(), ends, node.get_service_names_and_types()


def full_node_names(node: Node, hidden: bool = False) -> list[str]:
    """Return the full names of all nodes, sorted; those of hidden nodes begin with `_`."""
    found = node.get_node_names_and_namespaces()
    return sorted(
        f"{space.rstrip('/')}/{name}" for name, space in found if hidden or name[:1] != "_"
    )


def add_list(verbs: Verbs, what: str, find: Callable[[Node], Named],
             ends: Callable[[Node, Named], str] | None = None) -> None:
    """Add the verb `list`.

    Args:
        verbs: The verbs of the command.
        what: What it lists: `topics`, `services` or `actions`.
        find: Returns those that a node knows.
        ends: Returns what `-v` prints of those that are listed; without it there is no `-v`.
    """
    def run(options: argparse.Namespace) -> None:
        with graph_node(options.spin_time) as node:
            shown = [pair for pair in find(node)
                     if options.hidden or not topic_or_service_is_hidden(pair[0])]
            whole = ends(node, shown) if ends and options.verbose else None
        if options.count or whole:
            print(len(shown) if options.count else whole)
            return
        for name, types in shown:
            print(f"{name} [{', '.join(types)}]" if options.show_types else name)

    parser = verbs.add("list", run, f"List the {what}")
    add_discovery(parser)
    parser.add_argument("-t", "--show-types", action="store_true", help="show types as well")
    parser.add_argument("-c", f"--count-{what}", dest="count", action="store_true",
                        help="show only the number")  # fmt: skip
    if ends:
        parser.add_argument("-v", "--verbose", action="store_true",
                            help="show how many nodes publish and subscribe to each")  # fmt: skip
    parser.add_argument(f"--include-hidden-{what}", dest="hidden", action="store_true",
                        help="show names that begin with _ as well")  # fmt: skip


def add_type(verbs: Verbs, what: str, find: Callable[[Node], Named]) -> None:
    """Add the verb `type`; arguments as for `add_list`, but `what` is a `topic` or a `service`."""
    def run(options: argparse.Namespace) -> None:
        name = options.name
        with graph_node(options.spin_time, lambda node: name in dict(find(node))) as node:
            types = dict(find(node)).get(name)
        if types is None:
            raise CommandError(f"Nothing has the name '{name}'")
        print("\n".join(types))

    parser = verbs.add("type", run, f"Print a {what}'s type")
    add_discovery(parser)
    parser.add_argument("name", metavar=f"{what}_name")


@contextmanager
def held_interrupts() -> Iterator[list[int]]:
    """Yield a list that each Ctrl-C lengthens; an exception within rclpy would lose messages."""
    received: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: received.append(number))
    try:
        yield received
    finally:
        signal.signal(signal.SIGINT, before)


def spin(node: Node, done: Callable[[], Any] = lambda: False) -> None:
    """Call the node's callbacks until `done`, or until Ctrl-C."""
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        while not done():
            executor.spin_once(timeout_sec=_WAKE)
    finally:
        executor.remove_node(node)
        with suppress(KeyboardInterrupt):
            executor.shutdown()


def result(node: Node, future: Future) -> Any:
    """Wait for a future, and return its result."""
    spin(node, future.done)
    return future.result()
