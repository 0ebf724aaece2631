"""The `ros2` command."""

from __future__ import annotations

import argparse
import importlib
import signal
import sys
from collections.abc import Sequence

from ros2_embedded.cli.common import add_commands

COMMANDS = {
    "action": "Various action related sub-commands",
    "bag": "Various rosbag related sub-commands",
    "interface": "Show information about ROS interfaces",
    "launch": "Run a launch file",
    "node": "Various node related sub-commands",
    "param": "Various param related sub-commands",
    "pkg": "Various package related sub-commands",
    "run": "Run a package specific executable",
    "service": "Various service related sub-commands",
    "topic": "Various topic related sub-commands",
}


def _parser(arguments: Sequence[str]) -> argparse.ArgumentParser:
    """Knows every command, and the options of the one that is called."""
    parser = argparse.ArgumentParser(
        prog="ros2",
        description="ros2 is an extensible command-line tool for ROS 2.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--use-python-default-buffering",
        action="store_true",
        help="Do not force line buffering in stdout and instead use the python default buffering, "
        "which might be affected by PYTHONUNBUFFERED/-u and depends on whatever stdout is "
        "interactive or not",
    )
    parsers = add_commands(parser, "ros2", COMMANDS)
    called = next((word for word in arguments if not word.startswith("-")), None)
    if called in COMMANDS:
        module = importlib.import_module(f"ros2_embedded.cli.{called}")
        module.define(parsers[called])
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs `ros2`; returns the exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    parser = _parser(given)
    options = parser.parse_args(given)
    if sys.stdout is not None and not options.use_python_default_buffering:
        sys.stdout.reconfigure(line_buffering=True)  # type: ignore[union-attr]
    run = getattr(options, "run", None)
    if run is None:
        parser.print_help()
        return 0
    try:
        code = run(options)
    except KeyboardInterrupt:
        return int(signal.SIGINT)
    except BrokenPipeError:  # as in `ros2 topic echo /imu | head`
        sys.stderr.close()
        return 0
    except RuntimeError as error:
        code = str(error)
    if isinstance(code, str):
        print(code, file=sys.stderr)
        return 1
    return int(code or 0)
