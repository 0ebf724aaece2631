"""How every node declares and reads its parameters."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node

from door_impact_common.errors import SettingError

FRAME_PREFIX = ("", "text before the name of each frame in messages, such as robot1/")
"""Default and description of the parameter `frame_prefix`, for the tables of nodes with frames."""

_FILE = (', as in --ros-args --params-file "$(ros2 pkg prefix --share door_impact_bringup)'
         '/config/params.yaml"')  # NaN is the default of what a node cannot guess


class Parameters:
    """Parameters of a node, declared together and checked when they are read.

    Users type numbers as integers and switches as 0 or 1 on a command line. Parameters are
    therefore declared with dynamic types, and every read checks the type.

    Args:
        node: Node that declares the parameters.
        table: Default and description of each parameter, by name.
        read_only: Whether parameters can be given only when the node starts.
    """

    def __init__(
        self, node: Node, table: Mapping[str, tuple[Any, str]], *, read_only: bool = True
    ) -> None:
        self._node = node
        for name, (default, text) in table.items():
            # Each parameter needs a descriptor of its own, because rclpy writes the name into it.
            node.declare_parameter(
                name,
                default,
                ParameterDescriptor(description=text, read_only=read_only, dynamic_typing=True),
            )

    def value(self, name: str) -> Any:
        """Return a parameter as it was given, unchecked."""
        return self._node.get_parameter(name).value

    def text(self, name: str) -> str:
        """Return a parameter as text; an unset parameter is the empty text."""
        value = self.value(name)
        return "" if value is None else str(value)

    def choice(self, name: str, known: Collection[str]) -> str:
        """Return a parameter that must be one of the known words.

        Raises:
            SettingError: The parameter is another word.
        """
        value = self.text(name)
        if value not in known:
            raise SettingError(name, value, " or ".join(known))
        return value

    def number(self, name: str, low: float = -math.inf, high: float = math.inf, *,
               unknown: bool = False) -> float:
        """Return a parameter that must be a finite number from `low` to `high`.

        With `unknown` it may be NaN as well, which stands for what nobody knows.

        Raises:
            SettingError: The parameter is not a finite number, or is outside this range.
        """
        value = self.value(name)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise SettingError(name, value, "a finite number")
        if unknown and math.isnan(value):
            return math.nan
        if not math.isfinite(value):
            raise SettingError(name, value, "a finite number" + _FILE * math.isnan(value))
        if not low <= value <= high:
            raise SettingError(name, value, _range(low, high))
        return float(value)

    def numbers(self, name: str, count: int) -> tuple[float, ...]:
        """Return a parameter that must be a list of finite numbers.

        Raises:
            SettingError: The parameter is no list of `count` finite numbers.
        """
        value = self.value(name)
        listed = [*value] if isinstance(value, Sequence) and not isinstance(value, str) else []
        if len(listed) != count or not all(
                isinstance(entry, int | float) and not isinstance(entry, bool)
                and math.isfinite(entry) for entry in listed):
            raise SettingError(name, value, f"a list of {count} finite numbers")
        return tuple(map(float, listed))

    def positive(self, name: str) -> float:
        """Return a parameter that must be a finite number above 0.

        Raises:
            SettingError: The parameter is not a positive finite number.
        """
        value = self.number(name)
        if not value > 0.0:
            raise SettingError(name, value, "positive")
        return value

    def whole(self, name: str, low: int = 0) -> int:
        """Return a parameter that must be a whole number of at least `low`.

        Raises:
            SettingError: The parameter is not a whole number, or is below `low`.
        """
        value = self.number(name)
        if value != round(value) or value < low:
            raise SettingError(name, self.value(name), f"a whole number, {low} or more")
        return int(self.value(name))  # exact: a float keeps 53 bits only

    def switch(self, name: str) -> bool:
        """Return a parameter that must be true or false; 1 and 0 are accepted too.

        Raises:
            SettingError: The parameter is neither.
        """
        value = self.value(name)
        if value not in (True, False, "true", "false", "0", "1"):
            raise SettingError(name, value, "true or false")
        return value in (True, "true", "1")


def _range(low: float, high: float) -> str:
    if math.isinf(high):
        return f"{low:g} or more"
    return f"{high:g} or less" if math.isinf(low) else f"from {low:g} to {high:g}"
