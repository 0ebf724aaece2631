"""The `ros2` command."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Sequence

COMMANDS = {
    "action": "actions: list, info, send_goal",
    "interface": "show, list interfaces",
    "launch": "run a launch file",
    "node": "nodes: list, info",
    "param": "parameters: list, get, set, dump",
    "pkg": "packages: list, prefix, executables",
    "run": "run an executable of a package",
    "service": "services: list, type, call",
    "topic": "topics: list, info, type, echo, hz, pub",
}


def _usage() -> str:
    lines = [f"  {name:<10} {text}" for name, text in COMMANDS.items()]
    return "\n".join(["usage: ros2 COMMAND ... (ros2 COMMAND -h for help)", "", *lines])


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs `ros2`; returns the exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    if not given or given[0] in ("-h", "--help"):
        print(_usage())
        return 0 if given else 2
    name = given[0]
    if name not in COMMANDS:
        print(f"ros2: unknown command '{name}'\n\n{_usage()}", file=sys.stderr)
        return 2
    module = importlib.import_module(f"ros2_embedded.cli.{name}")
    try:
        return int(module.main(given[1:]) or 0)
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:  # as in `ros2 topic echo /imu | head`
        sys.stderr.close()
        return 0
