"""The node that a command has for the time that it runs, and discovery."""

from __future__ import annotations

import argparse
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import rclpy
from rclpy.exceptions import NameValidationException, RCLError
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.parameter import Parameter

from ros2_embedded.cli.common import CliError, finite, flag, option

PREFIX = "_ros2cli"
"""The names of these nodes begin with it, so that they are hidden."""

_SPIN_TIME = 0.5
_POLL = 0.05
_QUIET = 0.4
_LONGEST = 5.0
"""Longest wait for discovery [s]: Fast DDS announces its nodes with a heartbeat each 3 s."""


def add_direct_options(parser: argparse.ArgumentParser) -> None:
    """Adds the options of a verb whose node subscribes itself."""
    spin_time = ("Spin time in seconds to wait for discovery (only applies when not using an "
                 "already running daemon)")  # fmt: skip
    option("--spin-time", type=finite, default=_SPIN_TIME, help=spin_time)(parser)
    flag("-s", "--use-sim-time", text="Enable ROS simulation time")(parser)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Adds the options of a verb that ROS 2 may answer from its daemon; there is no daemon here."""
    add_direct_options(parser)
    flag("--no-daemon", text="Do not spawn nor use an already running daemon")(parser)


@contextmanager
def bare_node(name: str, **options: Any) -> Iterator[Node]:
    """A node that knows nothing yet; SIGTERM ends the command with that signal's number."""
    rclpy.init(args=[])
    try:
        yield Node(name, **options)
    except ExternalShutdownException:
        sys.exit(signal.SIGTERM)
    except RCLError:  # so ends what is asked of a context that is gone
        if rclpy.ok():
            raise
        sys.exit(signal.SIGTERM)
    finally:
        rclpy.try_shutdown()


@contextmanager
def command_node(
    options: argparse.Namespace, done: Callable[[Node], Any] = lambda node: False,
    name: str | None = None,
) -> Iterator[Node]:  # fmt: skip
    """A node that knows the graph, or at least as much of it as is `done`.

    Raises:
        CliError: a name that `done` asks for is not valid.
    """
    overrides = {
        "use_sim_time": getattr(options, "use_sim_time", False),
        "start_type_description_service": False,  # the node lives too briefly for them
    }
    with bare_node(
        name or f"{PREFIX}_{os.getpid()}",
        enable_rosout=False,
        start_parameter_services=False,
        parameter_overrides=[Parameter(key, value=value) for key, value in overrides.items()],
    ) as node:
        try:
            settle(node, lambda: done(node), getattr(options, "spin_time", _SPIN_TIME))
        except (NameValidationException, ValueError) as error:
            raise CliError(str(error)) from error
        yield node


def settle(node: Node, done: Callable[[], Any], spin_time: float = _SPIN_TIME) -> None:
    """Waits until discovery is complete and brings nothing new, or until `done`.

    Args:
        node: whose graph.
        done: tried now and then.
        spin_time: shortest wait [s] where it is not the default.
    """
    graph = node.context.graph
    start = changed = time.monotonic()
    shortest = 0.0 if spin_time == _SPIN_TIME else spin_time
    known = None
    while not done() and (waited := time.monotonic() - start) < max(_LONGEST, spin_time):
        now = (len(graph.endpoints()), len(graph.nodes()))
        if now != known:
            known, changed = now, time.monotonic()
        quiet = time.monotonic() - changed > _QUIET
        if quiet and waited >= shortest and graph.is_complete():
            return
        time.sleep(_POLL)


def await_peer(wait: Callable[[], bool]) -> None:
    """Waits for a peer. If a signal ends the command first, nothing more is printed."""
    if not wait():
        raise ExternalShutdownException


def spin_until(node: Node, future: Any) -> Any:
    """Result of a future; Ctrl-C comes through."""
    rclpy.spin_until_future_complete(node, future)
    if not future.done():
        raise ExternalShutdownException
    return future.result()
