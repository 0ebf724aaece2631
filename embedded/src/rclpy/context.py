"""A context: one participant of the DDS domain, and what hangs on it."""

from __future__ import annotations

import sys
import threading
import weakref
from collections.abc import Sequence
from typing import Any

from ros2_embedded.domain import domain_id as default_domain
from ros2_embedded.domain import join_domain
from ros2_embedded.graph import Graph
from ros2_embedded.reader_thread import ReaderThread

from rclpy.arguments import RosArguments, parse_arguments
from rclpy.exceptions import NotInitializedException, RCLError
from rclpy.logging import get_logging_severity_from_string, set_logger_level


class Context:
    """State between `init` and `shutdown`."""

    def __init__(self) -> None:
        """Is not initialised yet."""
        self._ok = False
        self._lock = threading.RLock()
        self._domain: Any = None
        self.participant: Any = None
        self.reader_thread: Any = None
        self.graph: Any = None
        self.arguments = RosArguments()
        self.nodes: weakref.WeakSet[Any] = weakref.WeakSet()
        self._sleepers: set[weakref.ref[Any]] = set()
        self._client_count = 0

    def init(self, args: Sequence[str] | None = None, *, domain_id: int | None = None) -> None:
        """Joins the domain.

        Args:
            args: command line; None takes the process's.
            domain_id: number of the domain; None takes ROS_DOMAIN_ID.

        Raises:
            RuntimeError: it has been initialised before.
            ArgumentError: the command line has a ROS argument that cannot be understood.
        """
        with self._lock:
            if self._ok:
                raise RuntimeError("Context.init() must only be called once")
            self._close()
            self.arguments = parse_arguments(sys.argv if args is None else args)
            for name, level in self.arguments.log_levels.items():
                set_logger_level(name, get_logging_severity_from_string(level))
            number = default_domain() if domain_id is None else domain_id
            self._domain, self.participant = join_domain(number)
            self.reader_thread = ReaderThread(self.participant)
            self.graph = Graph(self.participant, self.reader_thread)
            self.graph.on_other_node = self._warn_of_namesake
            self.graph.warn = self._warn
            self._ok = True

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

    def require_ok(self) -> None:
        """Raises NotInitializedException unless `ok`."""
        if not self._ok:
            raise NotInitializedException

    def next_client_number(self) -> int:
        """Numbers clients and services, whose identity goes into USER_DATA."""
        with self._lock:
            self._client_count += 1
            return self._client_count

    def poll(self) -> None:
        """Hands over what has come from the domain, without waiting for the reader thread."""
        thread = self.reader_thread
        if thread is not None:
            thread.poll()

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
        """Takes an `interrupt` back, for a last word to others before the shutdown."""
        self._ok = self.reader_thread is not None

    def shutdown(self) -> None:
        """Leaves the domain.

        Raises:
            RCLError: it has been shut down before.
        """
        if not self._ok:
            raise RCLError("failed to shutdown: rcl_shutdown already called on the given context")
        self.try_shutdown()

    def try_shutdown(self) -> None:
        """Leaves the domain, if it is in one."""
        self.interrupt()
        with self._lock:
            self._close()

    def _close(self) -> None:
        if self.reader_thread is None:
            return
        for node in list(self.nodes):
            node.destroy_node()
        self.reader_thread.stop()
        # In this order: a participant must be gone before its domain.
        self.graph = self.reader_thread = None
        self.participant = None
        self._domain = None


_default = Context()


def get_default_context() -> Context:
    """The context of `rclpy.init()`."""
    return _default
