"""Executables of packages: the entry points of their distributions."""

from __future__ import annotations

from importlib.metadata import EntryPoint, PackageNotFoundError, distribution


class EntryPointError(Exception):
    """There is no such package or executable."""


def executables(package: str) -> dict[str, EntryPoint]:
    """Executables of a package.

    Raises:
        EntryPointError: the package is not installed.
    """
    try:
        points = distribution(package).entry_points.select(group="console_scripts")
    except PackageNotFoundError:
        raise EntryPointError(f"Package '{package}' not found") from None
    return {point.name: point for point in points}


def find_entry_point(package: str, executable: str) -> EntryPoint:
    """The entry point behind `ros2 run PACKAGE EXECUTABLE`.

    Raises:
        EntryPointError: the package or the executable is not there.
    """
    found = executables(package)
    if executable not in found:
        names = ", ".join(sorted(found)) or "none"
        raise EntryPointError(
            f"No executable '{executable}' found in the package '{package}'; there are: {names}"
        )
    return found[executable]
