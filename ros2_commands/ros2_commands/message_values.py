"""Messages from YAML."""

from __future__ import annotations

import array
from typing import Any

import numpy as np
import yaml
from rosidl_parser.definition import (  # type: ignore[import-untyped]
    AbstractNestedType,
    NamespacedType,
)

from ros2_commands.errors import CommandError
from ros2_commands.interface_classes import interface_class

_REFUSALS = (AssertionError, TypeError, ValueError, OverflowError)
"""What conversions and the fields of messages raise."""


def message_from_yaml(kind: Any, text: str) -> Any:
    """Make a message, a request or a goal.

    Args:
        kind: Its class.
        text: A mapping of fields to values; fields that it does not name keep their defaults.

    Raises:
        CommandError: No such mapping, an unknown field, or a value that a field cannot hold.
    """
    try:
        return _message(kind, yaml.safe_load(text))
    except (*_REFUSALS, yaml.YAMLError) as error:
        raise CommandError(f"Failed to populate field: {error}") from error


def _message(kind: Any, values: Any) -> Any:
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
