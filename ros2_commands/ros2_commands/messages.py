"""Convert messages from and to text, as ROS 2 prints them, and find their classes by name."""

from __future__ import annotations

import array
import importlib
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import yaml
from builtin_interfaces.msg import Time
from rosidl_parser.definition import (  # type: ignore[import-untyped]
    AbstractNestedType,
    NamespacedType,
)

from ros2_commands.errors import CommandError

_WORDS = {"msg": "message", "srv": "service", "action": "action"}


def interface_class(name: str, kind: str) -> Any:
    """Import a class.

    Args:
        name: `package/kind/Name` or `package/Name`.
        kind: `msg`, `srv` or `action`.

    Raises:
        CommandError: There is no such type of this kind.
    """
    package, *middle, short = name.split("/")
    try:
        if middle in ([], [kind]):
            return getattr(importlib.import_module(f"{package}.{kind}"), short)
    except (ModuleNotFoundError, AttributeError, ValueError):
        pass
    raise CommandError(f"The passed {_WORDS[kind]} type is invalid: {name[:80]!r}")


def is_message(value: Any) -> bool:
    """Return whether a value is a message, not what a field of one holds."""
    return hasattr(value, "get_fields_and_field_types")


class _Dumper(yaml.SafeDumper):
    """Writes mappings in lines even in flow style, as ROS 2 does."""


def _in_lines(dumper: yaml.SafeDumper, mapping: dict[str, Any]) -> yaml.Node:
    return dumper.represent_mapping("tag:yaml.org,2002:map", mapping, flow_style=False)


_Dumper.add_representer(dict, _in_lines)


def to_yaml(message: Any, longest: int | None = None, flow: bool = False) -> str:
    """Write a message as YAML.

    Args:
        message: Any message.
        longest: Lists and strings are cut after so many elements; None means never.
        flow: Whether lists stand in one line.
    """
    return yaml.dump(
        _plain(message, longest), Dumper=_Dumper, sort_keys=False, allow_unicode=True,
        width=float("inf"), default_flow_style=flow,
    )  # fmt: skip


def _plain(value: Any, longest: int | None) -> Any:
    """Turn a message, or the value of a field, into mappings, lists and scalars."""
    if is_message(value):
        names = value.get_fields_and_field_types()
        return {name: _plain(getattr(value, name), longest) for name in names}
    if isinstance(value, bytes):
        value = value.decode("latin-1")
    if isinstance(value, str):
        return value if longest is None or len(value) <= longest else value[:longest] + "..."
    if not (isinstance(value, (list, tuple)) or hasattr(value, "tolist")):
        return value
    values = value.tolist() if hasattr(value, "tolist") else list(value)
    items = [_plain(item, longest) for item in values[:longest]]
    return [*items, "..."] if len(items) < len(value) else items


def to_csv(value: Any, longest: int | None = None) -> str:
    """Write all fields of a message, and of those within it, with commas between them."""
    return ",".join(_cells(_plain(value, longest)))


def _cells(plain: Any) -> Iterator[str]:
    if not isinstance(plain, (dict, list)):
        yield str(plain)
        return
    for item in plain.values() if isinstance(plain, dict) else plain:
        yield from _cells(item)


_REFUSALS = (AssertionError, TypeError, ValueError, OverflowError)
"""What conversions and the fields of messages raise."""


def message_from_yaml(kind: Any, text: str) -> Any:
    """Make a message, a request or a goal.

    Args:
        kind: Its class.
        text: A mapping of fields to values; fields that it does not name keep their defaults. A
            time may be `now`.

    Raises:
        CommandError: No such mapping, an unknown field, or a value that a field cannot hold.
    """
    try:
        return _message(kind, yaml.safe_load(text))
    except (*_REFUSALS, yaml.YAMLError) as error:
        raise CommandError(f"Failed to populate field: {error}") from error


def _message(kind: Any, values: Any) -> Any:
    if values == "now" and kind is Time:
        sec, nanosec = divmod(time.time_ns(), 10**9)
        return Time(sec=sec, nanosec=nanosec)
    message = kind(check_fields=True)
    if not isinstance(values, dict):
        raise TypeError(f"{kind.__name__} needs a mapping like {{field: value}}, not {values!r}")
    types = dict(zip(message.get_fields_and_field_types(), message.SLOT_TYPES, strict=True))
    for name, value in values.items():
        if name not in types:
            raise ValueError(
                f"{kind.__name__} has no field {name!r}; its fields: {', '.join(types)}"
            )
        try:
            setattr(message, name, _converted(getattr(message, name), types[name], value))
        except _REFUSALS as error:
            raise ValueError(f"{name}: {error}") from error
    return message


def _converted(current: Any, kind: Any, value: Any) -> Any:
    """Convert a value to the type that the field has now."""
    if isinstance(kind, AbstractNestedType):
        return _row(current, kind.value_type, list(value))
    if isinstance(kind, NamespacedType):
        return _message(type(current), value)
    return value if type(value) is type(current) else type(current)(value)


def _row(current: Any, kind: Any, values: list[Any]) -> Any:
    if isinstance(kind, NamespacedType):
        element = interface_class("/".join([*kind.namespaces, kind.name]), "msg")
        return [_message(element, value) for value in values]
    if isinstance(current, array.array):
        return array.array(current.typecode, values)
    return np.array(values, current.dtype) if isinstance(current, np.ndarray) else values
