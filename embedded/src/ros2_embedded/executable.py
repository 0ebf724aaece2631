"""Runs an executable of a package: `python -m ros2_embedded.executable PACKAGE EXECUTABLE ...`."""

from __future__ import annotations

import sys
from importlib.metadata import EntryPoint

from ros2_embedded.entry_points import executables


def run(name: str, point: EntryPoint, arguments: list[str]) -> object:
    """Runs the entry point as its script does; returns the script's argument of `sys.exit`."""
    sys.argv = [name, *arguments]
    return point.load()()


if __name__ == "__main__":
    package, executable = sys.argv[1:3]
    sys.exit(run(executable, executables(package)[executable], sys.argv[3:]))  # type: ignore[arg-type]
