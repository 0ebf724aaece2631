"""Files that a command writes."""

import os
from pathlib import Path

from door_model.errors import DoorModelError


def write_files(folder: str | Path, files: dict[str, bytes]) -> list[Path]:
    """Write files into a folder, which is made where it is missing; each appears whole or not.

    Args:
        folder: Where to write.
        files: Contents by name.

    Returns:
        What was written.

    Raises:
        DoorModelError: The folder cannot be made or written.
    """
    written = []
    for name, content in files.items():
        target = Path(folder) / name
        partial = target.with_name(f".{name}.{os.getpid()}.part")
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            try:
                partial.write_bytes(content)
                partial.replace(target)
            finally:
                partial.unlink(missing_ok=True)
        except OSError as error:
            raise DoorModelError(
                f"{target} cannot be written: {error.strerror}", value=str(target)) from error
        written.append(target)
    return written
