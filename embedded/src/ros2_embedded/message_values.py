"""Messages from YAML, as the `ros2` command reads them."""

from __future__ import annotations

import array
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from ros2_embedded.messages import message_class
from ros2_embedded.specs import FieldType


def fill(message: Any, values: Any, *, expand: bool = False) -> list[Callable[[Any], None]]:
    """Puts values into a message; a value is converted to the type of its field.

    Args:
        message: any message.
        values: mapping of fields to values.
        expand: whether `auto` for a header and `now` for a stamp mean a time that is still to come.

    Returns:
        Functions that each put a time into the message.

    Raises:
        AttributeError: there is no such field.
        TypeError: a value that cannot be converted.
        ValueError: another such value.
        AssertionError: a value that the field refuses.
    """
    stamps: list[Callable[[Any], None]] = []
    _fill(message, values, stamps if expand else None)
    return stamps


def _fill(message: Any, values: Any, stamps: list[Callable[[Any], None]] | None) -> None:
    if not isinstance(values, dict):
        kind = type(values).__name__
        raise TypeError(f"Value '{values}' is expected to be a dictionary but is a {kind}")
    kinds = {field.name: field.type for field in message._spec.fields}
    for name, value in values.items():
        if name not in kinds:
            raise AttributeError(f"'{type(message).__name__}' object has no attribute '{name}'")
        kind, current = kinds[name], getattr(message, name)
        if stamps is not None and (kind, value) == (FieldType("std_msgs/msg/Header"), "auto"):
            stamps.append(partial(setattr, current, "stamp"))
        elif stamps is not None and (kind, value) == (
            FieldType("builtin_interfaces/msg/Time"), "now"
        ):  # fmt: skip
            stamps.append(partial(setattr, message, name))
        else:
            setattr(message, name, _converted(kind, value, current, stamps))


def _converted(kind: FieldType, value: Any, current: Any, stamps: Any) -> Any:
    """A value of the type that the field has now."""
    if isinstance(current, array.array):
        return array.array(current.typecode, value)
    if isinstance(current, np.ndarray):
        return np.array(value, current.dtype)
    if kind.primitive:
        return value if type(value) is type(current) else type(current)(value)
    items = value if kind.container else [value]
    made = []
    for item in list(items):
        made.append(message_class(kind.base)())
        _fill(made[-1], item, stamps)
    return made if kind.container else made[0]
