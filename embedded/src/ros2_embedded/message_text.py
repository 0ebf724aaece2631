"""Messages as text: YAML and CSV, as the `ros2` command prints them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from itertools import dropwhile
from typing import Any

import yaml


def is_message(value: Any) -> bool:
    """Whether a value is a message, not what a field of one holds."""
    return hasattr(value, "get_fields_and_field_types")


class _Dumper(yaml.SafeDumper):
    """Writes mappings in lines whatever the style, as ROS 2 does."""


def _in_lines(dumper: yaml.SafeDumper, mapping: dict[str, Any]) -> yaml.Node:
    return dumper.represent_mapping("tag:yaml.org,2002:map", mapping, flow_style=False)


_Dumper.add_representer(dict, _in_lines)


def to_yaml(message: Any, *, flow: bool = False, **options: Any) -> str:
    """YAML of a message; `flow` puts lists into one line; other options as in `to_plain`."""
    return yaml.dump(
        to_plain(message, **options),
        Dumper=_Dumper,
        sort_keys=False,
        allow_unicode=True,
        width=float("inf"),
        default_flow_style=flow,
    )


def to_plain(
    value: Any, *, truncate: int | None = None, arrays: bool = True, strings: bool = True
) -> Any:
    """A message, or the value of a field, as plain mappings, lists and scalars.

    Args:
        value: Message or value.
        truncate: Longest list or string that is written in full; None means no limit.
        arrays: Whether lists are written in full; otherwise only their type and length.
        strings: Whether strings are written in full; otherwise only their length.
    """
    options: dict[str, Any] = {"truncate": truncate, "arrays": arrays, "strings": strings}
    if is_message(value):
        return {
            name: _abbreviated(getattr(value, name), kind)
            if not arrays and _is_row(getattr(value, name))
            else to_plain(getattr(value, name), **options)
            for name, kind in value.get_fields_and_field_types().items()
        }
    if isinstance(value, bytes):
        return _cut(value.decode("latin-1"), truncate)
    if isinstance(value, str):
        return _cut(value, truncate) if strings else f"<string length: <{len(value)}>>"
    if not _is_row(value):
        return value
    items = value.tolist() if hasattr(value, "tolist") else value
    if truncate is None or len(items) <= truncate:
        return [to_plain(item, **options) for item in items]
    return [*(to_plain(item, **options) for item in items[:truncate]), "..."]


def to_csv(
    value: Any, *, truncate: int | None = None, arrays: bool = True, strings: bool = True
) -> str:
    """All fields of a message, and of those within it, with commas; options as in `to_plain`."""
    options: dict[str, Any] = {"truncate": truncate, "arrays": arrays, "strings": strings}
    if is_message(value):
        fields = value.get_fields_and_field_types()
        texts = (
            _abbreviated(getattr(value, name), kind)
            if not arrays and _is_row(getattr(value, name))
            else to_csv(getattr(value, name), **options)
            for name, kind in fields.items()
        )
        return _joined(texts)
    if isinstance(value, str):
        return _cut(value, truncate) if strings else f"<string length: <{len(value)}>>"
    if not _is_row(value):
        return str(value)
    items = [to_csv(item, **options) for item in value[:truncate]]
    return _joined([*items, "..."] if len(value) > len(items) else items)


def _joined(texts: Iterable[str]) -> str:
    """Joins texts by commas, without a comma before the first text that is not empty, as ROS 2."""
    return ",".join(dropwhile(lambda text: not text, texts))


def _is_row(value: Any) -> bool:
    return isinstance(value, (list, tuple)) or hasattr(value, "tolist")


def _cut(text: str, truncate: int | None) -> str:
    return text if truncate is None or len(text) <= truncate else text[:truncate] + "..."


_KIND = re.compile(
    r"(?P<sequence>sequence<)?(?P<base>[\w/]+)(<\d+>)?(, (?P<most>\d+))?>?(\[(?P<size>\d+)\])?"
)


def _abbreviated(value: Any, kind: str) -> str:
    """Type and length of a sequence; `kind` is its type by `get_fields_and_field_types`."""
    match = _KIND.fullmatch(kind)
    assert match is not None, kind
    base = match["base"].replace("/", "/msg/")
    if match["size"]:
        return f"<array type: {base}[{match['size']}]>"
    bound = f"[{match['most']}]" if match["most"] else ""
    return f"<sequence type: {base}{bound}, length: {len(value)}>"
