"""How commands end, and how files and folders are written."""

import os
import sys
from collections.abc import Callable
from pathlib import Path

from door_impact_common.errors import DoorImpactError, OutputError


def run_command(name: str, work: Callable[[], str]) -> int:
    """Run a command, print its result, and return its exit code.

    Args:
        name: Name of the command, for the message of an error.
        work: Function that does the work and returns the text to print.

    Returns:
        0, or 1 after a DoorImpactError, which is printed in one line on stderr.
    """
    try:
        print(work())
    except DoorImpactError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return 1
    return 0


def make_folder(path: str | Path) -> Path:
    """Make a folder and the folders above it, if they do not exist.

    Returns:
        The folder.

    Raises:
        OutputError: The folder cannot be made.
    """
    try:
        Path(path).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"the folder {path} cannot be made: {error.strerror}", value=str(path)) from error
    return Path(path)


def write_whole(path: str | Path, content: str | bytes) -> None:
    """Write a file so that readers find it complete or not at all, never half written.

    The content goes to a hidden file in the same folder, which then replaces the target.

    Args:
        path: File to write; an older file is replaced.
        content: Bytes, or text that is written in UTF-8.

    Raises:
        OutputError: The file cannot be written; an older file is left as it was.
    """
    target = Path(path)
    if not target.name:
        raise OutputError(f"{str(path)!r} is not the name of a file", value=str(path))
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
