"""Messages from YAML, and YAML from messages, as the `ros2` command reads and writes them."""

from __future__ import annotations

import time
from typing import Any

import yaml

from ros2_embedded.messages import message_class
from ros2_embedded.specs import Field, FieldType

DEFAULT_TRUNCATION = 128


class MessageError(ValueError):
    """YAML that does not fit a message."""


def fill(message: Any, values: Any) -> None:
    """Puts values into a message.

    Args:
        message: any message.
        values: mapping of fields to values; None changes nothing. `auto` for a header and `now`
            for a stamp mean the time now.

    Raises:
        MessageError: an unknown field, or a value that does not fit; names the field.
    """
    _fill(message, values, "")


def _fill(message: Any, values: Any, where: str) -> None:
    name = message._spec.name
    if values is None:
        return
    if values == "auto" and name == "std_msgs/msg/Header":
        values = {"stamp": "now"}
    if values == "now" and name == "builtin_interfaces/msg/Time":
        sec, nanosec = divmod(time.time_ns(), 1_000_000_000)
        values = {"sec": sec, "nanosec": nanosec}
    if not isinstance(values, dict):
        raise MessageError(f"{where or name}: {values!r} is no mapping of fields to values")
    fields = {field.name: field for field in message._spec.fields}
    for key, value in values.items():
        path = f"{where}.{key}" if where else str(key)
        if key not in fields:
            known = ", ".join(fields) or "none"
            raise MessageError(f"{name} has no field '{key}' ({path}); its fields: {known}")
        try:
            setattr(message, key, _value(fields[key], value, getattr(message, key), path))
        except AssertionError as error:
            raise MessageError(f"{path}: {error}") from error


def _value(field: Field, value: Any, current: Any, where: str) -> Any:
    kind = field.type
    if not kind.container:
        return _scalar(kind, value, current, where)
    if not isinstance(value, list):
        raise MessageError(f"{where}: {value!r} is no list")
    new = message_class(kind.base) if not kind.primitive else lambda: None
    return [_scalar(kind, item, new(), f"{where}[{i}]") for i, item in enumerate(value)]


def _scalar(kind: FieldType, value: Any, current: Any, where: str) -> Any:
    if not kind.primitive:
        _fill(current, value, where)
        return current
    if kind.base.startswith("float") and type(value) is int:
        return float(value)
    if kind.base == "byte" and type(value) is int and 0 <= value < 256:
        return bytes([value])
    return value


def to_plain(value: Any, *, arrays: bool = True, truncate: int | None = DEFAULT_TRUNCATION) -> Any:
    """A message, or the value of a field, as plain mappings, lists and scalars.

    Args:
        value: message or value.
        arrays: whether to write lists out; otherwise only their type and length.
        truncate: longest list or string that is written whole; None for no limit.
    """
    if hasattr(value, "_spec"):
        plain = {}
        for field in value._spec.fields:
            item = getattr(value, field.name)
            if field.type.container and not arrays:
                kind = value.get_fields_and_field_types()[field.name]
                plain[field.name] = f"<{kind.replace('sequence<', 'sequence type: ').rstrip('>')}, "
                plain[field.name] += f"length: {len(item)}>"
            else:
                plain[field.name] = to_plain(item, arrays=arrays, truncate=truncate)
        return plain
    if isinstance(value, bytes):
        return value.decode("latin-1")
    if isinstance(value, str):
        return value if truncate is None or len(value) <= truncate else value[:truncate] + "..."
    if isinstance(value, (bool, int, float)):
        return value
    items = value.tolist() if hasattr(value, "tolist") else list(value)
    cut = truncate is not None and len(items) > truncate
    items = [
        to_plain(v, arrays=arrays, truncate=truncate) for v in items[: truncate if cut else None]
    ]
    return [*items, "..."] if cut else items


def to_yaml(value: Any, **options: Any) -> str:
    """YAML of a message; options as in `to_plain`. A scalar is written bare."""
    plain = to_plain(value, **options)
    if not isinstance(plain, (dict, list)):
        return f"{plain}\n"
    if not plain:
        return "{}\n" if isinstance(plain, dict) else "[]\n"
    return yaml.safe_dump(plain, sort_keys=False, allow_unicode=True, width=float("inf"))
