"""`ros2 run`: an executable of a package, in this very process unless it has a prefix."""

from __future__ import annotations

import argparse
import os
import shlex
import signal
import subprocess
import sys
import traceback
from importlib.metadata import EntryPoint

from ros2_embedded.cli.common import CliError
from ros2_embedded.entry_points import PackageError, executables
from ros2_embedded.executable import run as run_here


def define(parser: argparse.ArgumentParser) -> None:
    """Adds the options of `ros2 run`."""
    parser.add_argument(
        "--prefix",
        help="Prefix command, which should go before the executable. Command must be wrapped in "
        "quotes if it contains spaces (e.g. --prefix 'gdb -ex run --args').",
    )
    parser.add_argument("package_name", help="Name of the ROS package")
    parser.add_argument("executable_name", help="Name of the executable")
    parser.add_argument(
        "argv", nargs=argparse.REMAINDER, help="Pass arbitrary arguments to the executable"
    )
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    name = options.executable_name
    try:
        point = executables(options.package_name).get(name)
    except PackageError as error:
        raise CliError(str(error)) from error
    if point is None:
        raise CliError("No executable found")
    if options.prefix is None:
        code = _here(name, point, options.argv)
    else:
        module = [sys.executable, "-m", "ros2_embedded.executable", options.package_name, name]
        code = _behind(shlex.split(options.prefix) + module + options.argv)
    if code < 0:
        print(f"[ros2run]: {signal.strsignal(-code)}", flush=True)
    elif code:
        print(f"[ros2run]: Process exited with failure {code}", flush=True)
    return code


def _here(name: str, point: EntryPoint, arguments: list[str]) -> int:
    """Runs it; the exit code is what that of its own process would be."""
    try:
        result: object = run_here(name, point, arguments)
        sys.stdout.flush()
    except SystemExit as end:
        result = end.code
    except KeyboardInterrupt:
        traceback.print_exc()
        return -signal.SIGINT
    except BrokenPipeError:  # who reads the output has ended, as head does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return -signal.SIGPIPE
    except Exception:
        traceback.print_exc()
        return 1
    if isinstance(result, int):
        return result & 0xFF
    if result is not None:
        print(result, file=sys.stderr)
    return int(result is not None)


def _behind(command: list[str]) -> int:
    process = subprocess.Popen(command, env=os.environ)
    while True:
        try:
            return process.wait()
        except KeyboardInterrupt:  # the process has it as well, and ends
            continue
