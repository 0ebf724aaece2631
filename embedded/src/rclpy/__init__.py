"""The client library of ROS 2 for Python, as far as it is needed, on Eclipse Cyclone DDS."""

from __future__ import annotations

import atexit
from collections.abc import Sequence
from typing import Any

from rclpy.context import Context, get_default_context, initialized_contexts
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import (
    SignalHandlerOptions,
    install_signal_handlers,
    uninstall_signal_handlers,
)
from rclpy.task import Future
from rclpy.utilities import get_rmw_implementation_identifier, ok, try_shutdown
from rclpy.utilities import shutdown as _shutdown

__all__ = [
    "Context",
    "Future",
    "Node",
    "Parameter",
    "SignalHandlerOptions",
    "create_node",
    "get_default_context",
    "get_global_executor",
    "get_rmw_implementation_identifier",
    "init",
    "install_signal_handlers",
    "ok",
    "shutdown",
    "spin",
    "spin_once",
    "spin_until_future_complete",
    "try_shutdown",
    "uninstall_signal_handlers",
]

_global_executor: Executor | None = None


def init(
    *,
    args: Sequence[str] | None = None,
    context: Context | None = None,
    domain_id: int | None = None,
    signal_handler_options: SignalHandlerOptions | None = None,
) -> None:
    """Joins the domain; must be called before everything else.

    Args:
        args: Command line; None means that of the process.
        context: Another context than the default one; signal handlers then stay as they are.
        domain_id: Number of the domain; None means that of ROS_DOMAIN_ID.
        signal_handler_options: Signals to handle.

    Raises:
        RuntimeError: It has been called before.
    """
    chosen = context or get_default_context()
    if signal_handler_options is None:
        default = chosen is get_default_context()
        signal_handler_options = SignalHandlerOptions.ALL if default else SignalHandlerOptions.NO
    chosen.init(args, domain_id=domain_id)
    install_signal_handlers(signal_handler_options)


def shutdown(*, context: Context | None = None, uninstall_handlers: bool | None = None) -> None:
    """Leaves the domain.

    Raises:
        RuntimeError: `init` has not been called.
        RCLError: The domain has been left before, for example after Ctrl-C.
    """
    is_default = context is None or context is get_default_context()
    try:
        _shutdown(context=context)
    finally:
        if uninstall_handlers or (uninstall_handlers is None and is_default):
            uninstall_signal_handlers()


def _leave_all() -> None:
    for context in initialized_contexts():
        context.try_shutdown()


atexit.register(_leave_all)


def create_node(node_name: str, **options: Any) -> Node:
    """Creates a node; the options are those of `Node`."""
    return Node(node_name, **options)


def get_global_executor() -> Executor:
    """The executor of `spin` and its like."""
    global _global_executor
    executor = _global_executor
    if executor is None or not executor.context.ok():
        executor = _global_executor = SingleThreadedExecutor()
        get_default_context().on_shutdown(_forget_global_executor)  # at once after a SIGTERM
    return executor


def _forget_global_executor() -> None:
    global _global_executor
    if _global_executor is not None:
        _global_executor.shutdown()
    _global_executor = None


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
