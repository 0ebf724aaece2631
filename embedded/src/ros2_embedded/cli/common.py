"""Shared parts of the commands: tables of verbs, options, argument types, errors."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ros2_embedded.naming import is_hidden

_LARGEST = 1_000_000_000
_TOO_LARGE = f"the number is too large: at most {_LARGEST} expected"

Handler = Callable[[argparse.Namespace], "int | str | None"]
"""Runs a verb. If it returns a text, this is printed to stderr and the exit code is 1."""


Define = Callable[[argparse.ArgumentParser], Any]
"""Adds options to a parser."""


class CliError(RuntimeError):
    """An error that is shown to the user; the exit code of the command is 1."""


class Verb:
    """A verb of a command: its summary, the function that runs it, and what adds its options."""

    def __init__(self, summary: str, run: Handler, *options: Define) -> None:
        """The options are added in this order."""
        self.summary, self.run, self.options = summary, run, options


def add_commands(
    parser: argparse.ArgumentParser, call: str, summaries: Mapping[str, str]
) -> dict[str, argparse.ArgumentParser]:
    """Adds sub-commands with the help texts of ROS 2; returns their parsers."""
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
    """Adds the verbs of a command; without a verb the command prints its help."""

    def show_help(options: argparse.Namespace) -> None:
        parser.print_help()

    parser.set_defaults(run=show_help)
    summaries = {name: verb.summary for name, verb in verbs.items()}
    for name, subparser in add_commands(parser, parser.prog, summaries).items():
        for add in verbs[name].options:
            add(subparser)
        subparser.set_defaults(run=verbs[name].run)


def option(*names: str, **settings: Any) -> Define:
    """An option or a positional argument with the settings of `argparse`."""
    return lambda parser: parser.add_argument(*names, **settings)


def flag(*names: str, text: str, **settings: Any) -> Define:
    """An option without a value."""
    return option(*names, action="store_true", help=text, **settings)


def count_flag(what: str) -> Define:
    """The option to print only the number of `topics`, `services`, ..."""
    text = f"Only display the number of {what} discovered"
    return flag("-c", f"--count-{what}", dest="count", text=text)


def hidden_flag(what: str) -> Define:
    """The option to include hidden `topics` or `services`."""
    text = f"Consider hidden {what} as well"
    return flag(f"--include-hidden-{what}", dest="include_hidden", text=text)


def types_flag(what: str) -> Define:
    """The option to print the types as well."""
    return flag("-t", "--show-types", text=f"Additionally show the {what} type")


def exclusive(*options: Define) -> Define:
    """Options of which only one may be given."""

    def add(parser: argparse.ArgumentParser) -> None:
        group: Any = parser.add_mutually_exclusive_group()
        for each in options:
            each(group)

    return add


def window_option(default: int, text: str, **settings: Any) -> Define:
    """The option for the number of messages from which a rate is calculated."""
    text = f"{text} (default: {default})"
    return option("--window", "-w", type=positive_int, default=default, help=text, **settings)


Named = Sequence[tuple[str, list[str]]]
"""Pairs of a name (of a topic, a service or an action) and its types."""


def visible(found: Named, options: argparse.Namespace) -> Named:
    """The entries that are not hidden, or all entries if the option of `hidden_flag` is set."""
    return [pair for pair in found if options.include_hidden or not is_hidden(pair[0])]


def print_named(found: Named, options: argparse.Namespace, *, types: bool = False) -> None:
    """Prints one name per line, with its types if `types` is set, or only the number of names."""
    if options.count:
        print(len(found))
        return
    for name, kinds in found:
        print(f"{name} [{', '.join(kinds)}]" if types else name)


def print_of_type(found: Named, kind: str, options: argparse.Namespace) -> None:
    """Prints the names of the entries with a type, or only their number."""
    print_named([pair for pair in found if kind in pair[1]], options)


def whole(text: str) -> int:
    """Argument of a command line: an integer that every clock and every queue can hold."""
    number = int(text)
    if abs(number) > _LARGEST:
        raise argparse.ArgumentTypeError(_TOO_LARGE)
    return number


def finite(text: str) -> float:
    """Argument of a command line: a number that every clock can hold."""
    number = float(text)
    if not abs(number) <= _LARGEST:
        raise argparse.ArgumentTypeError(_TOO_LARGE)
    return number


def positive_int(text: str) -> int:
    """Argument of a command line: an integer above zero."""
    number = whole(text) if text.lstrip("+-").isdecimal() else -1
    if number <= 0:
        raise argparse.ArgumentTypeError("value must be a positive integer")
    return number


def unsigned_int(text: str) -> int:
    """Argument of a command line: an integer that is not negative."""
    number = whole(text) if text.lstrip("+-").isdecimal() else -1
    if number < 0:
        raise argparse.ArgumentTypeError("value must be non-negative integer")
    return number


def positive_float(text: str) -> float:
    """Argument of a command line: a number above zero."""
    try:
        number = finite(text)
    except ValueError:
        raise argparse.ArgumentTypeError("Expects a floating point number") from None
    if number <= 0.0:
        raise argparse.ArgumentTypeError("Value must be positive")
    return number


# argparse names these functions in its errors.
whole.__name__, finite.__name__ = "int", "float"


def values_options(name: str, text: str) -> Define:
    """The options for the YAML of a message, on the command line or from standard input."""
    return exclusive(
        option(name, nargs="?", default="{}", help=text), flag("--stdin", text=_STDIN[name])
    )


_STDIN = {
    "values": "Read values from standard input",
    "goal": "Read goal from standard input",
}


def given_values(options: argparse.Namespace, name: str) -> str:
    """The YAML that the user has given for `values_options`."""
    return sys.stdin.read() if options.stdin else getattr(options, name)
