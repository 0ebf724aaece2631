"""Interfaces that the user names."""

from __future__ import annotations

from typing import Any

from ros2_embedded.catalogue import full_name
from ros2_embedded.cli.common import CliError
from ros2_embedded.message_modules import interface_class
from ros2_embedded.specs import InterfaceError


def find(name: str, kind: str, problem: str) -> Any:
    """Class of an interface.

    Args:
        name: `pkg/kind/Name` or `pkg/Name`.
        kind: `msg`, `srv` or `action`.
        problem: Error message if the interface does not exist.

    Raises:
        CliError: The interface does not exist, or it is of another kind.
    """
    try:
        full = full_name(name, kind)
        if full.split("/")[1] == kind:
            return interface_class(full)
    except InterfaceError:
        pass
    raise CliError(problem)
