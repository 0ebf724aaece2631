"""The node of a command: discovery, and waiting for answers."""

from __future__ import annotations

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
    """Give a hidden node that knows nothing yet; Ctrl-C and SIGTERM are exceptions in it.

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
    """Give a node that knows the graph, or at least as much of it as is `done`.

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
    """List the full names of all nodes, sorted; those of hidden nodes begin with `_`."""
    found = node.get_node_names_and_namespaces()
    return sorted(
        f"{space.rstrip('/')}/{name}" for name, space in found if hidden or name[:1] != "_"
    )


def print_named(found: Named, *, types: bool, count: bool, hidden: bool) -> None:
    """Print one name a line, with its types, or only the number of names."""
    shown = [pair for pair in found if hidden or not topic_or_service_is_hidden(pair[0])]
    if count:
        print(len(shown))
        return
    for name, kinds in shown:
        print(f"{name} [{', '.join(kinds)}]" if types else name)


def print_type(found: Named, name: str) -> None:
    """Print the types of the topic or service of a name.

    Raises:
        CommandError: There is none of this name.
    """
    types = dict(found).get(name)
    if types is None:
        raise CommandError(f"Nothing has the name '{name}'")
    print("\n".join(types))


@contextmanager
def held_interrupts() -> Iterator[list[int]]:
    """Give a list that each Ctrl-C lengthens; an exception within rclpy would lose messages."""
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
    """Wait for what a future brings."""
    spin(node, future.done)
    return future.result()
