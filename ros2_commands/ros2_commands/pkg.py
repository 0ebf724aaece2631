"""`ros2 pkg`: list, prefix and executables."""

from __future__ import annotations

import argparse

from ament_index_python.packages import get_packages_with_prefixes

from ros2_commands.options import Verbs
from ros2_commands.packages import executables, prefix, share


def _list(options: argparse.Namespace) -> None:
    """List the packages."""
    for name in sorted(get_packages_with_prefixes()):
        print(name)


def _prefix(options: argparse.Namespace) -> None:
    """Print the folder that a package is installed below."""
    find = share if options.share else prefix
    print(find(options.package_name))


def _executables(options: argparse.Namespace) -> None:
    """List the executables of one package, or of all."""
    name = options.package_name
    for package in [name] if name else sorted(get_packages_with_prefixes()):
        for path in executables(package):
            print(path if options.full_path else f"{package} {path.name}")


def define(parser: argparse.ArgumentParser) -> None:
    """Add the verbs to the command's parser."""
    verbs = Verbs(parser)
    verbs.add("list", _list)
    where = verbs.add("prefix", _prefix)
    where.add_argument("package_name")
    where.add_argument("--share", action="store_true", help="print the share folder instead")
    programs = verbs.add("executables", _executables)
    programs.add_argument("package_name", nargs="?")
    programs.add_argument("--full-path", action="store_true", help="print paths")
