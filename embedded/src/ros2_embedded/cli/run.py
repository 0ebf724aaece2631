"""`ros2 run`: an executable of a package, in this very process."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from ros2_embedded.entry_points import EntryPointError, find_entry_point


def main(arguments: Sequence[str]) -> int:
    """Runs `ros2 run PACKAGE EXECUTABLE ...`."""
    parser = argparse.ArgumentParser(prog="ros2 run", description="Run an executable of a package.")
    parser.add_argument("package")
    parser.add_argument("executable")
    parser.add_argument("argv", nargs=argparse.REMAINDER, help="arguments of the executable")
    options = parser.parse_args(arguments)
    try:
        point = find_entry_point(options.package, options.executable)
    except EntryPointError as error:
        print(error, file=sys.stderr)
        return 1
    sys.argv = [options.executable, *options.argv]
    try:
        result = point.load()()
    except KeyboardInterrupt:  # so early that the program did not expect it
        return 130
    if isinstance(result, str):
        print(result, file=sys.stderr)
        return 1
    return int(result or 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
