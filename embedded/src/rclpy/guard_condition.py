"""Guard conditions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.entity import Entity
from rclpy.exceptions import InvalidHandle, RCLError


class GuardCondition(Entity):
    """Has a function called by the executor after `trigger`."""

    def __init__(self, node: Any, callback: Callable[[], Any], group: CallbackGroup | None) -> None:
        """Made by `Node.create_guard_condition`; raises RCLError after the shutdown."""
        if not node.context.ok():
            raise RCLError("failed to create guard_condition: the given context is not valid")
        super().__init__(node, group, 1)
        self.callback = callback
        self._destroyed = False

    def trigger(self) -> None:
        """Asks for a call; several times before it make one; any thread may do so.

        Raises:
            InvalidHandle: it was destroyed.
        """
        if self._destroyed:
            raise InvalidHandle("cannot use Destroyable because destruction was requested")
        self.receive([None])

    def handle(self, _: None) -> Any:
        """Calls the callback."""
        return self.callback()

    def destroy(self) -> None:
        """Ends it."""
        self._destroyed = True
        self._inbox.clear()
