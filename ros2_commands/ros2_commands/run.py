"""`ros2 run`: an executable of a package."""

from __future__ import annotations

import argparse
import shlex
import signal
import subprocess
from types import FrameType

from ros2_commands.packages import executable


def define(parser: argparse.ArgumentParser) -> None:
    """Add the options to the command's parser."""
    parser.add_argument("--prefix", default="", help="words before the command, as 'gdb --args'")
    parser.add_argument("package_name")
    parser.add_argument("executable_name")
    parser.add_argument("argv", nargs=argparse.REMAINDER, help="arguments for the executable")
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    path = executable(options.package_name, options.executable_name)
    process = subprocess.Popen([*shlex.split(options.prefix), str(path), *options.argv])

    def forward(number: int, frame: FrameType | None) -> None:
        process.send_signal(number)

    signal.signal(signal.SIGTERM, forward)
    signal.signal(signal.SIGINT, lambda *_: None)  # the terminal sends it to the executable, too
    status = process.wait()
    if status < 0:
        print("[ros2run]:", signal.strsignal(-status))
    elif status:
        print("[ros2run]: Process exited with failure", status)
    return status
