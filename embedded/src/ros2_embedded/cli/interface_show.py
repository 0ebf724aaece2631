"""`ros2 interface show`."""

from __future__ import annotations

import argparse
import re
import sys
from typing import Any

from ament_index_python.resources import has_resource

from ros2_embedded.catalogue import interface_text, list_packages
from ros2_embedded.cli.common import CliError, exclusive, flag, option
from ros2_embedded.specs import InterfaceError, parse_message


class _Type(argparse.Action):
    """Reads the name of an interface from the argument, or from standard input if it is `-`."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,
    ) -> None:
        if values == "-":
            if sys.stdin.isatty():
                parser.error("expected stdin pipe")
            values = sys.stdin.readline().strip()
        if not values:
            parser.error("the passed value is empty")
        setattr(namespace, self.dest, values)


OPTIONS = (
    exclusive(
        flag("--all-comments",
             text="Show all comments, including for nested interface definitions"),
        flag("--no-comments", text="Show no comments or whitespace"),
    ),
    option("type", action=_Type,
           help="Show an interface definition (e.g. 'example_interfaces/msg/String'). Passing '-' "
           "reads the argument from stdin (e.g. 'ros2 topic type /chatter | ros2 interface show "
           "-')."),
)  # fmt: skip


def show(options: argparse.Namespace) -> None:
    """Prints the definition, with the fields of nested types indented below each field."""
    lines = expanded(options.type, not options.no_comments, options.all_comments)
    print("\n".join(lines))


def expanded(name: str, comments: bool, nested_comments: bool, depth: int = 0) -> list[str]:
    """Lines of a definition, with or without comments; depth is that of the indentation.

    Raises:
        CliError: there is no such interface.
    """
    lines = []
    package = name.split("/")[0]
    for raw in definition(name).splitlines():
        text = raw.rstrip() if comments else _without_comment(raw.rstrip())
        if text is not None:
            lines.append("\t" * depth + text if text else "")
        if raw.strip() != "---":
            for field in parse_message(f"{package}/msg/Line", raw).fields:
                if not field.type.primitive:
                    inner = field.type.base
                    lines += expanded(inner, nested_comments, nested_comments, depth + 1)
    return lines


def definition(name: str) -> str:
    """Source of an interface.

    Raises:
        CliError: there is no such interface.
    """
    parts = name.split("/")
    if len(parts) != 3:
        raise CliError(f"Invalid name '{name}'. Expected three parts separated by '/'")
    if not all(parts):
        raise CliError(f"Invalid name '{name}'. Must not contain empty parts")
    if parts[0] not in list_packages():
        raise CliError(f"Unknown package '{parts[0]}'")
    try:
        return interface_text(name)
    except InterfaceError:
        prefix = has_resource("packages", parts[0]) or sys.prefix
        raise CliError(f"Could not find the interface '{prefix}/share/{name}.idl'") from None


_UNIT = re.compile(r"\s*\[[^,\]]+\]")


def _without_comment(line: str) -> str | None:
    """A line without its comment, or None; a `#` after a field stays, as in ROS 2."""
    if line.startswith("#"):
        return None if line.lstrip("#") else line
    code, mark, comment = line.partition("#")
    if not code.strip():
        return line or None
    if mark:
        words = _UNIT.sub("", comment) if len(_UNIT.findall(comment)) == 1 else comment
        if words.strip():
            return line[: line.find(words.strip()) - 1].strip()
    return line
