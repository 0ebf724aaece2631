"""`ros2 launch`."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory

from ros2_embedded.cli.common import CliError, exclusive, flag, option
from ros2_embedded.launch.description import Argument, read_arguments, read_launch_file
from ros2_embedded.launch.errors import LaunchError
from ros2_embedded.launch.log import LaunchLog
from ros2_embedded.launch.supervisor import Supervisor

_OPTIONS = (
    flag("-n", "--noninteractive", default=not sys.stdin.isatty(),
         text="Run the launch system non-interactively, with no terminal associated"),
    flag("-d", "--debug",
         text="Put the launch system in debug mode, provides more verbose output."),
    exclusive(
        flag("-p", "--print", "--print-description",
             text="Print the launch description to the console without launching it."),
        flag("-s", "--show-args", "--show-arguments",
             text="Show arguments that may be given to the launch file."),
    ),
    flag("-a", "--show-all-subprocesses-output",
         text="Show all launched subprocesses' output by overriding their output configuration "
         "using the OVERRIDE_LAUNCH_PROCESS_OUTPUT envvar."),
    option("--launch-prefix",
           help="Prefix command, which should go before all executables. Command must be wrapped "
           "in quotes if it contains spaces (e.g. --launch-prefix 'xterm -e gdb -ex run --args')."),
    option("--launch-prefix-filter",
           help="Regex pattern for filtering which executables the --launch-prefix is applied to "
           "by matching the executable name."),
    option("package_name", help="Name of the ROS package which contains the launch file"),
    option("launch_file_name", nargs="?", help="Name of the launch file"),
    option("launch_arguments", nargs="*",
           help="Arguments to the launch file; '<name>:=<value>' (for duplicates, last one wins)"),
)  # fmt: skip


def define(parser: argparse.ArgumentParser) -> None:
    """Adds the options of `ros2 launch`."""
    for add in _OPTIONS:
        add(parser)
    parser.set_defaults(run=_run)


def find_file(package: str, name: str | None) -> Path:
    """Finds a launch file by its name, anywhere in a package's share folder.

    Raises:
        CliError: There is no file of this name, or there are several.
    """
    try:
        share = get_package_share_directory(package)
    except (PackageNotFoundError, ValueError) as error:
        raise CliError(f"Package '{package}' not found: {error}") from error
    walk = os.walk(share)
    found = [os.path.join(folder, name) for folder, _, files in walk if name and name in files]
    where = f"in the share directory of package '{package}'"
    if not found:
        raise CliError(f"file '{name}' was not found {where} which is at '{share}'")
    if len(found) > 1:
        paths = ", ".join(f"'{path}'" for path in found)
        raise CliError(f"file '{name}' was found more than once {where}: [{paths}]")
    return Path(found[0])


def split_arguments(arguments: list[str]) -> dict[str, str]:
    """Arguments `name:=value`; of two of one name the last wins.

    Raises:
        CliError: one has another form.
    """
    values = {}
    for argument in arguments:
        name, separator, value = argument.partition(":=")
        if not separator or not name or not value:
            raise CliError(
                f"malformed launch argument '{argument}', expected format '<name>:=<value>'"
            )
        values[name] = value
    return values


def show_arguments(arguments: list[Argument]) -> None:
    """Prints what may be given to a launch file."""
    print("Arguments (pass arguments as '<name>:=<value>'):")
    for argument in arguments:
        star = "*" if argument.conditional else ""
        print(f"\n    '{argument.name}':{star}\n        {argument.description}")
        if argument.default is not None:
            print(f"        (default: {argument.default})")
    if any(argument.conditional for argument in arguments):
        print("\n* argument(s) which are only used if specific conditions occur")
    if not arguments:
        print("\n  No arguments.")


def _path(options: argparse.Namespace) -> tuple[Path, list[str]]:
    """The launch file, and the arguments for it."""
    rest = list(options.launch_arguments)
    path = Path(options.package_name)
    if path.is_file():
        return path.absolute(), [a for a in (options.launch_file_name, *rest) if a is not None]
    return find_file(options.package_name, options.launch_file_name), rest


def _run(options: argparse.Namespace) -> int:
    path, rest = _path(options)
    if options.launch_prefix is None and options.launch_prefix_filter is not None:
        raise CliError("--launch-prefix must be specified if --launch-prefix-filter is provided")
    if options.show_args:
        try:
            show_arguments(read_arguments(path))
        except LaunchError as error:
            raise CliError(str(error)) from error
        return 0
    given = split_arguments(rest)
    if options.launch_prefix:
        given["launch-prefix"] = options.launch_prefix
    if options.launch_prefix_filter:
        given["launch-prefix-filter"] = options.launch_prefix_filter
    if options.show_all_subprocesses_output:
        os.environ["OVERRIDE_LAUNCH_PROCESS_OUTPUT"] = "both"
    log = LaunchLog()
    log.say("INFO", "launch", f"All log files can be found below {log.folder}")
    log.say("INFO", "launch", "Default logging verbosity is set to INFO")
    try:
        plan = read_launch_file(path, given)
    except LaunchError as error:
        text = f"Caught exception in launch (see debug for traceback): {error}"
        log.say("ERROR", "launch", text)
        return 1
    if options.print:
        print("\n".join(" ".join(process.command) for process in plan.processes))
        return 0
    return Supervisor(plan, log).run()
