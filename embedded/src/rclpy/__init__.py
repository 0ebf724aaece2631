"""ROS 2's Python client library, the part of it that is needed here, on Eclipse Cyclone DDS."""

from __future__ import annotations

import atexit
from collections.abc import Sequence
from typing import Any

from rclpy.context import Context, get_default_context
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import (
    SignalHandlerOptions,
    install_signal_handlers,
    uninstall_signal_handlers,
)
from rclpy.task import Future
from rclpy.utilities import ok

__all__ = [
    "Context",
    "Future",
    "Node",
    "SignalHandlerOptions",
    "create_node",
    "get_default_context",
    "get_global_executor",
    "init",
    "ok",
    "shutdown",
    "spin",
    "spin_once",
    "spin_until_future_complete",
    "try_shutdown",
]

_global_executor: Executor | None = None


def init(
    *,
    args: Sequence[str] | None = None,
    context: Context | None = None,
    domain_id: int | None = None,
    signal_handler_options: SignalHandlerOptions | None = None,
) -> None:
    """Joins the domain; must come before everything else.

    Args:
        args: command line; None takes the process's.
        context: a context of one's own; signals then stay as they are.
        domain_id: number of the domain; None takes ROS_DOMAIN_ID.
        signal_handler_options: which signals to handle.

    Raises:
        RuntimeError: it has been called before.
    """
    chosen = context or get_default_context()
    chosen.init(args, domain_id=domain_id)
    if signal_handler_options is None:
        signal_handler_options = (
            SignalHandlerOptions.ALL if context is None else SignalHandlerOptions.NO
        )
    install_signal_handlers(chosen, signal_handler_options)


def shutdown(*, context: Context | None = None, uninstall_handlers: bool | None = None) -> None:
    """Leaves the domain.

    Raises:
        RCLError: it has been left before, as after Ctrl-C.
    """
    _end_spinning(context)
    (context or get_default_context()).shutdown()
    _clean_up(context, uninstall_handlers)


def try_shutdown(*, context: Context | None = None, uninstall_handlers: bool | None = None) -> None:
    """Leaves the domain, if it is in one."""
    _end_spinning(context)
    (context or get_default_context()).try_shutdown()
    _clean_up(context, uninstall_handlers)


def _end_spinning(context: Context | None) -> None:
    """Has `spin` return in other threads: the shutdown is no surprise to them."""
    global _global_executor
    if _global_executor is not None and context in (None, _global_executor.context):
        if _global_executor.context.ok():
            _global_executor.shutdown()
        _global_executor = None


def _clean_up(context: Context | None, uninstall: bool | None) -> None:
    if uninstall or (uninstall is None and context is None):
        uninstall_signal_handlers()


atexit.register(try_shutdown)


def create_node(node_name: str, **options: Any) -> Node:
    """Creates a node; the options are those of `Node`."""
    return Node(node_name, **options)


def get_global_executor() -> Executor:
    """The executor of `spin` and its like."""
    global _global_executor
    if _global_executor is None:
        _global_executor = SingleThreadedExecutor()
    return _global_executor


def spin(node: Node, executor: Executor | None = None) -> None:
    """Runs the node's callbacks until the shutdown; afterwards no executor has the node.

    Raises:
        ExternalShutdownException: SIGTERM.
    """
    chosen = executor or get_global_executor()
    try:
        chosen.add_node(node)
        while chosen.context.ok():
            chosen.spin_once()
    finally:
        chosen.remove_node(node)


def spin_once(
    node: Node, *, executor: Executor | None = None, timeout_sec: float | None = None
) -> None:
    """Runs one callback; afterwards no executor has the node."""
    chosen = executor or get_global_executor()
    try:
        chosen.add_node(node)
        chosen.spin_once(timeout_sec)
    finally:
        chosen.remove_node(node)


def spin_until_future_complete(
    node: Node,
    future: Future,
    executor: Executor | None = None,
    timeout_sec: float | None = None,
) -> None:
    """Runs the node's callbacks until a future is done or the time is over.

    Afterwards no executor has the node, unless the chosen one had it before.
    """
    chosen = executor or get_global_executor()
    added = chosen.add_node(node)
    try:
        chosen.spin_until_future_complete(future, timeout_sec)
    finally:
        if added:
            chosen.remove_node(node)
