"""Messages as text: YAML and CSV, as ROS 2 prints them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import yaml


def is_message(value: Any) -> bool:
    """Tell whether a value is a message, not what a field of one holds."""
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
    if not _is_row(value):
        return value
    items = [_plain(item, longest) for item in (_list(value))[:longest]]
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


def _is_row(value: Any) -> bool:
    return isinstance(value, (list, tuple)) or hasattr(value, "tolist")


def _list(value: Any) -> list[Any]:
    return value.tolist() if hasattr(value, "tolist") else list(value)
