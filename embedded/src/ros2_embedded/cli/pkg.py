"""`ros2 pkg`: list, prefix, executables."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from ament_index_python.packages import (
    PackageNotFoundError,
    get_package_prefix,
    get_package_share_directory,
    get_packages_with_prefixes,
)

from ros2_embedded.cli.common import CliError, run
from ros2_embedded.entry_points import EntryPointError, executables


def _define_list(parser: argparse.ArgumentParser) -> None:
    """There is nothing to choose."""


def _list(options: argparse.Namespace) -> None:
    """Output a list of available packages."""
    print("\n".join(sorted(get_packages_with_prefixes())))


def _define_prefix(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("package_name")
    parser.add_argument("--share", action="store_true", help="the share folder instead")


def _prefix(options: argparse.Namespace) -> None:
    """Output the prefix path of a package."""
    find = get_package_share_directory if options.share else get_package_prefix
    try:
        print(find(options.package_name))
    except PackageNotFoundError as error:
        raise CliError("Package not found") from error


def _define_executables(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("package_name")


def _executables(options: argparse.Namespace) -> None:
    """Output a list of package specific executables."""
    try:
        for name in sorted(executables(options.package_name)):
            print(f"{options.package_name} {name}")
    except EntryPointError as error:
        raise CliError(str(error)) from error


def main(arguments: Sequence[str]) -> int:
    """Runs `ros2 pkg ...`."""
    verbs = {
        "list": (_define_list, _list),
        "prefix": (_define_prefix, _prefix),
        "executables": (_define_executables, _executables),
    }
    return run("pkg", "Various package related commands.", verbs, arguments)
