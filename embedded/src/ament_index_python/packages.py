"""Packages of the index."""

from __future__ import annotations

import os
from pathlib import Path

from ament_index_python.resources import get_resources, get_search_paths, has_resource


class PackageNotFoundError(KeyError):
    """The index has no such package."""

    def __str__(self) -> str:
        """Names the package and the prefixes that were searched."""
        return f"package '{self.args[0]}' not found, searching: {get_search_paths()}"


def get_packages_with_prefixes() -> dict[str, str]:
    """Every package and its prefix."""
    return get_resources("packages")


def get_package_prefix(package_name: str) -> str:
    """Prefix that the package is installed under.

    Raises:
        PackageNotFoundError: the index has no such package.
        ValueError: the name has characters that a package name cannot have.
    """
    if not package_name.replace("_", "").replace("-", "").isalnum():
        raise ValueError(f"'{package_name}' is not a valid package name")
    prefix = has_resource("packages", package_name)
    if not isinstance(prefix, str):
        raise PackageNotFoundError(package_name)
    return prefix


def get_package_share_directory(package_name: str, print_warning: bool = True) -> str:
    """Folder of the package's files, `PREFIX/share/PACKAGE`."""
    return os.path.join(get_package_prefix(package_name), "share", package_name)


def get_package_share_path(package_name: str, print_warning: bool = True) -> Path:
    """Like `get_package_share_directory`, as a path."""
    return Path(get_package_share_directory(package_name))
