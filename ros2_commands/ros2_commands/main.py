"""Command `ros2`: find the module of a subcommand and run it."""

from __future__ import annotations

import argparse
import importlib
import io
import os
import signal
import sys
from collections.abc import Sequence

_COMMANDS = {
    "action": "list, describe and call actions",
    "interface": "list and show message, service and action types",
    "launch": "run a launch file",
    "node": "list and describe nodes",
    "param": "list, get and set parameters of nodes",
    "pkg": "find packages and their executables",
    "run": "run an executable of a package",
    "service": "list and call services",
    "topic": "list topics, print and publish messages",
}
_ONLY_IN_ROS2 = ("bag", "component", "control", "daemon", "doctor", "extension_points",
                 "extensions", "lifecycle", "multicast", "plugin", "security", "test",
                 "trace", "wtf")  # fmt: skip


def _parser(called: str | None) -> argparse.ArgumentParser:
    """Return a parser of every command, with the options of the one that is called alone."""
    parser = argparse.ArgumentParser(
        prog="ros2", description="Commands of ROS 2 on rclpy; a part of what ROS 2's own has."
    )
    parser.set_defaults(run=lambda options: parser.print_help())
    commands = parser.add_subparsers(title="commands", metavar="COMMAND")
    for name, summary in _COMMANDS.items():
        command = commands.add_parser(name, help=summary, description=summary)
        if name == called:
            module = "launch.command" if name == "launch" else name
            importlib.import_module(f"ros2_commands.{module}").define(command)
    return parser


def _run(arguments: list[str]) -> int:
    called = arguments[0] if arguments else None
    if called in _ONLY_IN_ROS2:
        way = "record with the launch argument record:=FILE.mcap" if called == "bag" else (
            "install ROS 2 for it")
        print(f"ros2 {called} is not part of ros2_commands: {way}", file=sys.stderr)
        return 1
    options = _parser(called).parse_args(arguments)
    return int(options.run(options) or 0)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run `ros2`.

    Args:
        arguments: Words after `ros2`; by default those of the process.

    Returns:
        The exit status: 0, or 1 after an error, or the number of the signal that ended it.
    """
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(line_buffering=True)
    try:
        return _run(list(sys.argv[1:] if arguments is None else arguments))
    except KeyboardInterrupt:
        return int(signal.SIGINT)
    except BrokenPipeError:  # the reader has ended, as in `ros2 topic echo /imu | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except RuntimeError as error:  # ours, and those of rclpy
        print(error, file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
