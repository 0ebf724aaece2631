"""How every node declares and reads its parameters."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node

from door_impact_common.errors import SettingError


class Parameters:
    """Parameters of a node, declared at once and checked when they are read.

    Numbers may be given as integers and switches as 0 or 1, as people type them on a command line;
    so the middleware is told that types may change, and each read checks the type.

    Args:
        node: The node to declare them on.
        table: Default and description of each parameter, by name.
        read_only: Whether they can only be given when the node starts.
    """

    def __init__(
        self, node: Node, table: Mapping[str, tuple[Any, str]], *, read_only: bool = True
    ) -> None:
        self._node = node
        for name, (default, text) in table.items():
            # Each needs a descriptor of its own: rclpy writes the name into it.
            node.declare_parameter(
                name,
                default,
                ParameterDescriptor(description=text, read_only=read_only, dynamic_typing=True),
            )

    def value(self, name: str) -> Any:
        """A parameter as it was given, unchecked."""
        return self._node.get_parameter(name).value

    def text(self, name: str) -> str:
        """A parameter as text; empty where it is not set."""
        value = self.value(name)
        return "" if value is None else str(value)

    def choice(self, name: str, known: Collection[str]) -> str:
        """A parameter that must be one of some words.

        Raises:
            SettingError: It is another word.
        """
        value = self.text(name)
        if value not in known:
            raise SettingError(name, value, " or ".join(known))
        return value

    def number(self, name: str, low: float = -math.inf, high: float = math.inf) -> float:
        """A parameter that must be a finite number from `low` to `high`.

        Raises:
            SettingError: It is none, or outside this range.
        """
        value = self.value(name)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise SettingError(name, value, "a finite number")
        if not math.isfinite(value):
            raise SettingError(name, value, "a finite number")
        if not low <= value <= high:
            raise SettingError(name, value, _range(low, high))
        return float(value)

    def positive(self, name: str) -> float:
        """A parameter that must be a finite number above 0.

        Raises:
            SettingError: It is none.
        """
        value = self.number(name)
        if not value > 0.0:
            raise SettingError(name, value, "positive")
        return value

    def whole(self, name: str, low: int = 0) -> int:
        """A parameter that must be a whole number of at least `low`.

        Raises:
            SettingError: It is none.
        """
        value = self.number(name)
        if value != round(value) or value < low:
            raise SettingError(name, self.value(name), f"a whole number, {low} or more")
        return int(value)

    def switch(self, name: str) -> bool:
        """A parameter that must be true or false.

        Raises:
            SettingError: It is neither.
        """
        value = self.value(name)
        if value not in (True, False, "true", "false", "0", "1"):
            raise SettingError(name, value, "true or false")
        return value in (True, "true", "1")


def _range(low: float, high: float) -> str:
    if math.isinf(high):
        return f"{low:g} or more"
    return f"{high:g} or less" if math.isinf(low) else f"from {low:g} to {high:g}"
