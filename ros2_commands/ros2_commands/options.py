"""Define verbs of commands, and options that several verbs have."""

from __future__ import annotations

import argparse
from collections.abc import Callable

_SPIN_TIME = 3.2
"""Fast DDS tells a new node every 3 s what it has missed so far [s]."""

Handler = Callable[[argparse.Namespace], "int | None"]
"""Runs a verb; returns the exit status."""


class Verbs:
    """The verbs of a command; without a verb the command prints its help."""

    def __init__(self, command: argparse.ArgumentParser) -> None:
        command.set_defaults(run=lambda options: command.print_help())
        self._verbs = command.add_subparsers(title="verbs", metavar="VERB")

    def add(self, name: str, run: Handler, summary: str = "") -> argparse.ArgumentParser:
        """Add a verb.

        Args:
            name: Its name.
            run: Runs it.
            summary: What its help says; by default the first line of the docstring of `run`.

        Returns:
            The parser for the verb's options.
        """
        summary = summary or (run.__doc__ or "").splitlines()[0].rstrip(".")
        verb = self._verbs.add_parser(name, help=summary, description=summary)
        verb.set_defaults(run=run)
        return verb


def add_discovery(parser: argparse.ArgumentParser) -> None:
    """Add the options with which ROS 2's own commands look for nodes."""
    parser.add_argument("--spin-time", type=positive, default=_SPIN_TIME, metavar="N",
                        help="wait N seconds for discovery (default: %(default)s)")  # fmt: skip
    parser.add_argument("--no-daemon", action="store_true", help="accepted; there is no daemon")


def positive(text: str) -> float:
    """Read a number above zero, at most 1e9: clocks hold no more.

    Raises:
        argparse.ArgumentTypeError: The text is none.
    """
    try:
        number = float(text)
    except ValueError:
        number = 0.0
    if not 0 < number <= 1e9:
        raise argparse.ArgumentTypeError(f"a number above 0 expected, not {text[:20]!r}")
    return number


def count(text: str) -> int:
    """Read a whole number of at most nine digits.

    Raises:
        argparse.ArgumentTypeError: The text is none.
    """
    if not (text.isdecimal() and len(text) <= 9):
        raise argparse.ArgumentTypeError(f"at most nine digits expected, not {text[:20]!r}")
    return int(text)
