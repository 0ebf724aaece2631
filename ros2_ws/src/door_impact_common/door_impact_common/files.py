"""What commands print and write."""

import os
import sys
from collections.abc import Callable
from pathlib import Path

from door_impact_common.errors import DoorImpactError, OutputError


def run_command(name: str, work: Callable[[], str]) -> int:
    """Print what a command has to say, or its error in one line on stderr; the exit code."""
    try:
        print(work())
    except DoorImpactError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return 1
    return 0


def make_folder(path: str | Path) -> Path:
    """Make a folder where it is missing, with those above it.

    Raises:
        OutputError: It cannot be made.
    """
    try:
        Path(path).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"the folder {path} cannot be made: {error.strerror}", value=str(path)) from error
    return Path(path)


def write_whole(path: str | Path, content: str | bytes) -> None:
    """Write a file that appears whole or not at all.

    Raises:
        OutputError: It cannot be written.
    """
    target = Path(path)
    if not target.name:
        raise OutputError(f"{str(path)!r} is no file's name", value=str(path))
    partial = target.with_name(f".{target.name}.{os.getpid()}.part")
    if isinstance(content, str):
        content = content.encode("utf-8", "backslashreplace")
    try:
        partial.write_bytes(content)
        partial.replace(target)
    except OSError as error:
        partial.unlink(missing_ok=True)
        raise OutputError(
            f"{target} cannot be written: {error.strerror}", value=str(target)) from error
