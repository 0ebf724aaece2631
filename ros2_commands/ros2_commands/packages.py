"""Find packages and their executables by the ament index."""

from __future__ import annotations

import os
from pathlib import Path

from ament_index_python.packages import (
    PackageNotFoundError,
    get_package_prefix,
    get_package_share_directory,
)

from ros2_commands.errors import CommandError


def prefix(package: str) -> Path:
    """Return the folder that a package is installed below.

    Raises:
        CommandError: There is no such package.
    """
    try:
        return Path(get_package_prefix(package))
    except (PackageNotFoundError, ValueError):
        raise CommandError(f"Package '{package}' not found") from None


def share(package: str) -> Path:
    """Return the share folder of a package.

    Raises:
        CommandError: There is no such package.
    """
    prefix(package)
    return Path(get_package_share_directory(package))


def executables(package: str) -> list[Path]:
    """Return the programs of a package, sorted.

    Raises:
        CommandError: There is no such package.
    """
    found = (prefix(package) / "lib" / package).rglob("*")
    return sorted(path for path in found if path.is_file() and os.access(path, os.X_OK))


def executable(package: str, name: str) -> Path:
    """Return the path of a program of a package.

    Raises:
        CommandError: There is no such package, or it has no such program.
    """
    for path in executables(package):
        if path.name == name:
            return path
    raise CommandError(f"executable '{name}' not found in the package '{package}'")
