"""What the commands share: their tables of verbs, kinds of arguments, errors."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

Handler = Callable[[argparse.Namespace], "int | str | None"]
"""Does the work; a text that it returns is an error: it goes to stderr, the exit code is 1."""


class CliError(RuntimeError):
    """What the user is to be told; the command then ends with 1."""


class Verb(NamedTuple):
    """A verb of a command: what it is for, its options, what it does."""

    summary: str
    define: Callable[[argparse.ArgumentParser], None]
    run: Handler


def add_commands(
    parser: argparse.ArgumentParser, call: str, summaries: Mapping[str, str]
) -> dict[str, argparse.ArgumentParser]:
    """Adds sub-commands, in the way in which ROS 2 shows them; returns their parsers."""
    width = max(map(len, summaries))
    lines = (f"{name.ljust(width)}  {text}\n" for name, text in summaries.items())
    subparsers = parser.add_subparsers(
        title="Commands",
        description="".join(lines),
        metavar=f"Call `{call} <command> -h` for more detailed usage.",
    )
    return {
        name: subparsers.add_parser(
            name, description=text, formatter_class=argparse.RawDescriptionHelpFormatter
        )
        for name, text in summaries.items()
    }


def define_verbs(parser: argparse.ArgumentParser, verbs: Mapping[str, Verb]) -> None:
    """Adds a command's verbs; without one the command shows its help."""

    def show_help(options: argparse.Namespace) -> None:
        parser.print_help()

    parser.set_defaults(run=show_help)
    summaries = {name: verb.summary for name, verb in verbs.items()}
    for name, subparser in add_commands(parser, parser.prog, summaries).items():
        verbs[name].define(subparser)
        subparser.set_defaults(run=verbs[name].run)


def positive_int(text: str) -> int:
    """Argument of a command line: an integer above zero."""
    number = int(text) if text.lstrip("+-").isdecimal() else -1
    if number <= 0:
        raise argparse.ArgumentTypeError("value must be a positive integer")
    return number


def unsigned_int(text: str) -> int:
    """Argument of a command line: an integer that is not negative."""
    number = int(text) if text.lstrip("+-").isdecimal() else -1
    if number < 0:
        raise argparse.ArgumentTypeError("value must be non-negative integer")
    return number


def positive_float(text: str) -> float:
    """Argument of a command line: a number above zero."""
    try:
        number = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError("Expects a floating point number") from None
    if number <= 0.0:
        raise argparse.ArgumentTypeError("Value must be positive")
    return number


def add_values(parser: argparse.ArgumentParser, name: str, text: str) -> Any:
    """Adds the YAML of a message, on the command line or from standard input."""
    group = parser.add_mutually_exclusive_group()
    group.add_argument(name, nargs="?", default="{}", help=text)
    group.add_argument("--stdin", action="store_true", help=_STDIN[name])


_STDIN = {
    "values": "Read values from standard input",
    "goal": "Read goal from standard input",
}


def given_values(options: argparse.Namespace, name: str) -> str:
    """What `add_values` was given."""
    return sys.stdin.read() if options.stdin else getattr(options, name)
