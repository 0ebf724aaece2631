"""A context: one participant of the DDS domain, and what hangs on it."""

from __future__ import annotations

import os
import sys
import threading
import weakref
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from ros2_embedded.background import Background
from ros2_embedded.domain import discovery, join_domain
from ros2_embedded.domain import domain_id as default_domain
from ros2_embedded.graph import Graph
from ros2_embedded.interrupts import signals_wait
from ros2_embedded.wait_set import WaitSet

from rclpy.arguments import RosArguments, parse_arguments
from rclpy.exceptions import RCLError
from rclpy.impl.log_output import outputs
from rclpy.logging import get_logger, get_logging_severity_from_string, set_logger_level
from rclpy.weak_method import weakly

_initialized: weakref.WeakSet[Context] = weakref.WeakSet()


class Context:
    """State between `init` and `shutdown`; it is used once."""

    def __init__(self) -> None:
        """Is not initialised yet."""
        self._ok = self._used = False
        self.lock = threading.RLock()
        """A thread holds it while the context must not leave the domain."""
        self._domain: Any = None
        self._domain_id = 0
        self._on_shutdown: list[Callable[[], Any]] = []
        self.participant: Any = None
        self.background: Any = None
        self.graph: Any = None
        self.arguments = RosArguments()
        self.nodes: weakref.WeakSet[Any] = weakref.WeakSet()
        self._wait_sets: weakref.WeakSet[WaitSet] = weakref.WeakSet()
        self._sleepers: set[weakref.ref[Any]] = set()
        self.in_callback: set[int] = set()
        """Threads that run a callback; a shutdown in a callback waits for its end."""
        self.leaves_after_callback = False
        self._client_count = 0

    def init(
        self,
        args: Sequence[str] | None = None,
        *,
        initialize_logging: bool = True,
        domain_id: int | None = None,
    ) -> None:
        """Joins the domain.

        Args:
            args: Command line; None means that of the process.
            initialize_logging: Whether the logging options of the command line are used.
            domain_id: Number of the domain; None means that of ROS_DOMAIN_ID.

        Raises:
            RuntimeError: It has been initialised before, or the domain's number is out of range.
            ArgumentError: A ROS argument of the command line is invalid.
            UnknownROSArgsError: A ROS argument of the command line is unknown.
        """
        with self.lock:
            if domain_id is not None and domain_id < 0:
                raise RuntimeError(f"Domain id ({domain_id}) should not be lower than zero.")
            if self._used:
                raise RuntimeError("Context.init() must only be called once")
            self.arguments = parse_arguments(sys.argv if args is None else args)
            if initialize_logging:
                _configure_logging(self.arguments)
            self._domain_id = default_domain() if domain_id is None else domain_id
            asked = discovery(os.environ)
            for warning in asked.warnings:
                get_logger("rcl").warning(warning)
            self._domain, self.participant = join_domain(self._domain_id, asked)
            self.background = Background()
            self.graph = Graph(self.participant, self.background)
            self.graph.on_other_node = self._warn_of_namesake
            self.graph.warn = self._warn
            self._ok = self._used = True
            _initialized.add(self)

    def __enter__(self) -> Context:
        """Joins the domain."""
        self.init()
        return self

    def __exit__(self, *_: object) -> None:
        """Leaves the domain."""
        self.try_shutdown()

    def _warn(self, full_name: str, text: str) -> None:
        for node in list(self.nodes):
            if node.get_fully_qualified_name() == full_name:
                node.get_logger().warning(text)

    def _warn_of_namesake(self, full_name: str) -> None:
        self._warn(
            full_name,
            f"A node named {full_name} is already in the graph: two nodes of one name "
            "confuse their users; end one, or rename it with --ros-args -r __node:=NAME",
        )

    def ok(self) -> bool:
        """Whether it is initialised and not shut down."""
        return self._ok

    def get_domain_id(self) -> int:
        """The number of the domain.

        Raises:
            RuntimeError: it has not been initialised.
        """
        if not self._used:
            raise RuntimeError("Context must be initialized before it can have a domain id")
        return self._domain_id

    def next_client_number(self) -> int:
        """Numbers clients and services, whose identity goes into USER_DATA."""
        with self.lock:
            self._client_count += 1
            return self._client_count

    @contextmanager
    def staying(self, task: str) -> Iterator[None]:
        """Stays in the domain until something is done in it, such as "create publisher".

        Raises:
            RCLError: it has been left.
        """
        with self.lock:
            if not self._ok:
                raise RCLError(f"Failed to {task}: rcl node's context is invalid")
            yield

    def new_wait_set(self) -> WaitSet:
        """A wait set for an executor; it ends with the context.

        Raises:
            RCLError: the domain has been left.
        """
        with self.staying("create wait set"):
            made = WaitSet()
            self._wait_sets.add(made)
            return made

    def interrupt(self) -> None:
        """Ends it from a signal handler: nothing runs on, the domain is left later."""
        self._ok = False
        for reference in list(self._sleepers):
            sleeper = reference()
            if sleeper is not None:
                sleeper.wake()

    def wake_at_end(self, sleeper: Any) -> None:
        """Has `sleeper.wake()` called at the end, maybe in a signal handler."""
        self._sleepers.add(weakref.ref(sleeper, self._sleepers.discard))

    def resume(self) -> None:
        """Undoes an `interrupt`, so that last messages can be sent before the shutdown."""
        self._ok = self.background is not None

    def on_shutdown(self, callback: Callable[[], Any]) -> None:
        """Has `callback` called at the shutdown, or at once if that was already.

        Raises:
            TypeError: it cannot be called.
        """
        if not callable(callback):
            raise TypeError(f"callback should be a callable, got {type(callback)}")
        if self._used and not self._ok:
            callback()
        elif hasattr(callback, "__self__"):
            self._on_shutdown.append(weakly(callback))
        else:
            self._on_shutdown.append(callback)

    def destroy(self) -> None:
        """Does nothing more than the shutdown has done: nothing is left to be freed."""

    def shutdown(self) -> None:
        """Leaves the domain.

        Raises:
            RuntimeError: it has not been initialised.
            RCLError: it has been shut down before, as by Ctrl-C.
        """
        if not self._used:
            raise RuntimeError("Context must be initialized before it can be shutdown")
        was_ok = self._ok
        self.try_shutdown()
        if not was_ok:
            raise RCLError("failed to shutdown: rcl_shutdown already called on the given context")

    def try_shutdown(self) -> None:
        """Leaves the domain, if it is in one."""
        callbacks, self._on_shutdown = (self._on_shutdown if self._ok else []), []
        self._ok = False
        try:
            # First of all: one of them has `rclpy.spin` return in other threads.
            for callback in callbacks:
                callback()
        finally:
            self.interrupt()
            self.leaves_after_callback = threading.get_ident() in self.in_callback
            if not self.leaves_after_callback:
                self.leave()

    def leave(self) -> None:
        """Leaves the domain after the shutdown."""
        # If this is interrupted, threads of Cyclone DDS outlive the interpreter and crash.
        with signals_wait(), self.lock:
            if self.background is None:
                return
            # First of all: a thread that waits for a lock of this one must not be waited for.
            for wait_set in list(self._wait_sets):
                wait_set.close()
            self.background.stop()
            for node in list(self.nodes):
                # Not `destroy_node`: a program may override it, and rclpy does not call it here.
                node.handle.destroy(node)
            outputs.console.enabled = True
            # In this order: a participant must be gone before its domain.
            self.graph = self.background = None
            self.participant = None
            self._domain = None


def _configure_logging(arguments: RosArguments) -> None:
    for name, level in arguments.log_levels.items():
        set_logger_level(name, get_logging_severity_from_string(level))
    outputs.console.enabled = arguments.flags.get("stdout", True)


def initialized_contexts() -> list[Context]:
    """The contexts that have been initialised and are still there."""
    return list(_initialized)


_default: Context | None = None
_default_lock = threading.RLock()


def get_default_context(*, shutting_down: bool = False) -> Context:
    """The context of `rclpy.init()`; after a shutdown there is a new one."""
    global _default
    with _default_lock:
        context = _default or Context()
        _default = None if shutting_down else context
        return context
