"""`ros2 launch`: start the nodes of a launch file in YAML, or show its arguments."""

from __future__ import annotations

import argparse
from pathlib import Path

from ros2_commands.errors import CommandError
from ros2_commands.launch.reader import Argument, read_arguments, read_processes
from ros2_commands.launch.supervisor import LaunchLog, Supervisor
from ros2_commands.packages import share


def define(parser: argparse.ArgumentParser) -> None:
    """Add the options to the command's parser."""
    parser.add_argument("-s", "--show-args", "--show-arguments", action="store_true",
                        help="show what may be given to the launch file")  # fmt: skip
    parser.add_argument("package_name", help="package, or path of a launch file")
    parser.add_argument("words", nargs="*", metavar="launch_file_name | name:=value",
                        help="file in the package's share folder, then arguments")  # fmt: skip
    parser.set_defaults(run=_run)


def _find(package: str, words: list[str]) -> tuple[Path, list[str]]:
    """Find the launch file; return it and the words that are arguments for it."""
    path = Path(package)
    if path.is_file():
        return path.absolute(), words
    folder = share(package)
    name = words[0] if words else ""
    found = sorted(folder.rglob(name)) if name else []
    if len(found) != 1:
        problem = "was found more than once" if found else "was not found"
        raise CommandError(f"file '{name}' {problem} in the share directory of package "
                           f"'{package}' which is at '{folder}'")  # fmt: skip
    return found[0], words[1:]


def _split(words: list[str]) -> dict[str, str]:
    """Read words `name:=value`; of two of one name the last counts."""
    values = {}
    for word in words:
        name, separator, value = word.partition(":=")
        if not (name and separator):
            raise CommandError(
                f"malformed launch argument '{word}', expected format '<name>:=<value>'"
            )
        values[name] = value
    return values


def _show(arguments: list[Argument]) -> None:
    print("Arguments (pass arguments as '<name>:=<value>'):")
    for argument in arguments:
        print(f"\n    '{argument.name}':\n        {argument.description}")
        if argument.default is not None:
            print(f"        (default: {argument.default})")
    if not arguments:
        print("\n  No arguments.")


def _run(options: argparse.Namespace) -> int:
    path, words = _find(options.package_name, options.words)
    if options.show_args:
        _show(read_arguments(path))
        return 0
    given = _split(words)
    log = LaunchLog()
    log.say("INFO", "launch", f"All log files can be found below {log.folder}")
    log.say("INFO", "launch", "Default logging verbosity is set to INFO")
    try:
        processes = read_processes(path, given)
    except CommandError as error:
        text = f"Caught exception in launch (see debug for traceback): {error}"
        log.say("ERROR", "launch", text)
        return 1
    Supervisor(log).run(processes)
    return 0
