"""Drawing of a figure for a command of the terminal."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from door_impact_common.errors import OutputError


def draw_into(path: Path, draw: Callable[[], None]) -> None:
    """Draw a figure into a file.

    Args:
        path: File to write.
        draw: Function that imports what it needs, and writes the figure.

    Raises:
        OutputError: The figure cannot be drawn.
    """
    try:
        if path.is_dir() or not path.name:
            raise IsADirectoryError("it is a folder")
        draw()
    except (OSError, ValueError, ImportError) as error:
        raise OutputError(f"cannot draw {path}: {error}", value=str(path)) from error
