"""Drawing of a figure for a command of the terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path


def is_drawn(program: str, path: Path, draw: Callable[[], None]) -> bool:
    """Draw a figure into a file; a failure is printed on stderr in one line.

    Args:
        program: Name of the command, for the message.
        path: File to write.
        draw: Function that imports what it needs, and writes the figure.

    Returns:
        Whether the figure was written.
    """
    try:
        if path.is_dir() or not path.name:
            raise IsADirectoryError("it is a folder")
        draw()
    except (OSError, ValueError, ImportError) as error:
        print(f"{program}: cannot draw {path}: {error}", file=sys.stderr)
        return False
    return True
