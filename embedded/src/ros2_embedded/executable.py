"""Runs an executable of a package: `python -m ros2_embedded.executable PACKAGE EXECUTABLE ...`."""

from __future__ import annotations

import os
import signal
import sys
from importlib.metadata import EntryPoint
from typing import Any

from ros2_embedded.entry_points import executables


def run(name: str, point: EntryPoint, arguments: list[str]) -> object:
    """Runs the entry point as its script does; returns the script's argument of `sys.exit`."""
    sys.argv = [name, *arguments]

    def end(number: int, _: Any) -> None:
        os.write(2, f"{name}: interrupted before it began\n".encode())
        signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)

    # While modules are loaded, an exception could come out of any of them, and as any error.
    before = signal.signal(signal.SIGINT, end)
    script = point.load()
    signal.signal(signal.SIGINT, before)
    return script()


if __name__ == "__main__":
    package, executable = sys.argv[1:3]
    sys.exit(run(executable, executables(package)[executable], sys.argv[3:]))  # type: ignore[arg-type]
