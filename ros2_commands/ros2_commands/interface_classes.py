"""Classes of message, service and action types by their names."""

from __future__ import annotations

import importlib
from typing import Any

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
