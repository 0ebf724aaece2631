"""`ros2 launch`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory

from ros2_embedded.launch.description import read_arguments, read_launch_file
from ros2_embedded.launch.errors import LaunchError
from ros2_embedded.launch.supervisor import Supervisor

_SUFFIXES = (".launch.yaml", ".launch.yml")


def find_file(package: str, name: str) -> Path:
    """The launch file of that name, anywhere in a package's share folder.

    Raises:
        LaunchError: there is none, or it is not in YAML.
    """
    try:
        share = Path(get_package_share_directory(package))
    except (PackageNotFoundError, ValueError) as error:
        raise LaunchError(str(error)) from error
    for folder in (share / "launch", share):
        if (folder / name).is_file():
            return folder / name
    known = ", ".join(sorted(p.name for s in _SUFFIXES for p in (share / "launch").glob(f"*{s}")))
    raise LaunchError(f"'{name}' was not found in '{package}'; there are: {known or 'none'}")


def _split(arguments: list[str]) -> dict[str, str]:
    values = {}
    for argument in arguments:
        name, separator, value = argument.partition(":=")
        if not separator or not name:
            raise LaunchError(
                f"malformed launch argument '{argument}', expected format '<name>:=<value>'"
            )
        values[name] = value
    return values


def _show_arguments(path: Path) -> None:
    arguments = read_arguments(path)
    print("Arguments (pass arguments as '<name>:=<value>'):")
    if not arguments:
        print("\n  No arguments.")
    for argument in arguments:
        print(f"\n    '{argument.name}':\n        {argument.description}")
        if argument.choices:
            print(f"        Valid choices are: {list(argument.choices)}")
        if argument.default is not None:
            print(f"        (default: '{argument.default}')")


def main(arguments: Sequence[str]) -> int:
    """Runs `ros2 launch PACKAGE FILE ...` or `ros2 launch PATH ...`."""
    parser = argparse.ArgumentParser(prog="ros2 launch", description="Run a launch file (YAML).")
    parser.add_argument("package_or_path", help="package, or path of a launch file")
    parser.add_argument(
        "rest",
        nargs="*",
        metavar="file_and_arguments",
        help="name of the launch file, after a package; arguments name:=value",
    )
    parser.add_argument("-s", "--show-args", action="store_true", help="show the arguments and end")
    parser.add_argument("-p", "--print", action="store_true", help="print the commands and end")
    options = parser.parse_intermixed_args(arguments)
    rest = list(options.rest)
    try:
        path = Path(options.package_or_path)
        if not path.is_file():
            if not rest or ":=" in rest[0]:
                raise LaunchError(f"no such launch file: '{path}'")
            path = find_file(options.package_or_path, rest.pop(0))
        if not path.name.endswith((".yaml", ".yml")):
            raise LaunchError(f"{path}: only launch files in YAML are supported here")
        if options.show_args:
            _show_arguments(path)
            return 0
        plan = read_launch_file(path.resolve(), _split(rest))
    except LaunchError as error:
        print(f"[ERROR] [launch]: {error}", file=sys.stderr)
        return 1
    for message in plan.messages:
        print(f"[INFO] [launch.user]: {message}")
    if options.print:
        print("\n".join(" ".join(process.command) for process in plan.processes))
        return 0
    return Supervisor(plan.processes).run()
