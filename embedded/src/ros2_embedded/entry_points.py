"""Executables of packages: the entry points of their distributions."""

from __future__ import annotations

from importlib.metadata import EntryPoint, PackageNotFoundError, distribution

from ament_index_python.resources import has_resource


class PackageError(Exception):
    """There is no such package."""


def executables(package: str) -> dict[str, EntryPoint]:
    """Executables of a package.

    Raises:
        PackageError: the package is not installed.
    """
    try:
        points = distribution(package).entry_points.select(group="console_scripts")
    except (PackageNotFoundError, ValueError):
        if not has_resource("packages", package):
            raise PackageError(f"Package '{package}' not found") from None
        return {}
    return {point.name: point for point in points}
