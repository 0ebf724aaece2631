"""Resources of the index: files `PREFIX/share/ament_index/resource_index/TYPE/NAME`."""

from __future__ import annotations

import os
import sys
from pathlib import Path

_INDEX = Path("share", "ament_index", "resource_index")


def get_search_paths() -> list[str]:
    """Prefixes in order of search: those of AMENT_PREFIX_PATH, then the interpreter's own."""
    listed = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    paths = [path for path in listed if path and Path(path).is_dir()]
    return [*paths, sys.prefix] if sys.prefix not in paths else paths


def has_resource(resource_type: str, resource_name: str) -> str | bool:
    """The prefix that holds the resource, or False."""
    for prefix in get_search_paths():
        if (Path(prefix) / _INDEX / resource_type / resource_name).is_file():
            return prefix
    return False


def get_resource(resource_type: str, resource_name: str) -> tuple[str, str]:
    """Content and prefix of a resource.

    Raises:
        LookupError: there is no such resource.
    """
    prefix = has_resource(resource_type, resource_name)
    if not isinstance(prefix, str):
        raise LookupError(
            f"Could not find the resource '{resource_name}' of type '{resource_type}'"
        )
    path = Path(prefix) / _INDEX / resource_type / resource_name
    return path.read_text(encoding="utf-8"), prefix


def get_resources(resource_type: str) -> dict[str, str]:
    """Every resource of a type and its prefix; the first prefix wins."""
    found: dict[str, str] = {}
    for prefix in get_search_paths():
        folder = Path(prefix) / _INDEX / resource_type
        if folder.is_dir():
            for path in folder.iterdir():
                if not path.name.startswith("."):
                    found.setdefault(path.name, prefix)
    return found
