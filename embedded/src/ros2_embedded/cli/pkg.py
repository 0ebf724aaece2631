"""`ros2 pkg`: list, prefix, executables, xml."""

from __future__ import annotations

import argparse
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from ament_index_python.packages import (
    PackageNotFoundError,
    get_package_prefix,
    get_package_share_directory,
    get_packages_with_prefixes,
)

from ros2_embedded.cli.common import CliError, Verb, define_verbs
from ros2_embedded.entry_points import PackageError, executables


def _define_list(parser: argparse.ArgumentParser) -> None:
    """There is nothing to choose."""


def _list(options: argparse.Namespace) -> None:
    for name in sorted(get_packages_with_prefixes()):
        print(name)


def _add_package(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("package_name", help="The package name")


def _define_prefix(parser: argparse.ArgumentParser) -> None:
    _add_package(parser)
    parser.add_argument(
        "--share", action="store_true", help="Show share directory for the package"
    )  # fmt: skip


def _prefix(options: argparse.Namespace) -> str | None:
    find = get_package_share_directory if options.share else get_package_prefix
    try:
        print(find(options.package_name))
    except (PackageNotFoundError, ValueError):
        return "Package not found"
    return None


def _define_executables(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("package_name", nargs="?", help="The package name")
    parser.add_argument(
        "--full-path", action="store_true", help="Show full path of each executable"
    )


def _executables(options: argparse.Namespace) -> None:
    given = options.package_name
    for package in [given] if given else sorted(get_packages_with_prefixes()):
        try:
            names = sorted(executables(package))
        except PackageError as error:
            raise CliError(str(error)) from error
        for name in names:
            path = Path(sys.executable).with_name(name)
            print(path if options.full_path else f"{package} {name}")


def _define_xml(parser: argparse.ArgumentParser) -> None:
    _add_package(parser)
    parser.add_argument("-t", "--tag", help="The XML tag to output (e.g. 'version')")


def _xml(options: argparse.Namespace) -> str | None:
    try:
        path = Path(get_package_share_directory(options.package_name)) / "package.xml"
    except (PackageNotFoundError, ValueError):
        return "Package not found"
    if not path.is_file():
        return "Package XML manifest not found"
    tree = ElementTree.parse(path)
    if options.tag is None:
        ElementTree.dump(tree)
        return None
    elements = tree.getroot().findall(options.tag)
    for element in elements:
        print(element.text)
    return None if elements else "XML tag not found"


def define(parser: argparse.ArgumentParser) -> None:
    """Adds the verbs of `ros2 pkg`."""
    verbs = {
        "executables": Verb(
            "Output a list of package specific executables", _define_executables, _executables
        ),
        "list": Verb("Output a list of available packages", _define_list, _list),
        "prefix": Verb("Output the prefix path of a package", _define_prefix, _prefix),
        "xml": Verb("Output the XML of the package manifest or a specific tag", _define_xml, _xml),
    }
    define_verbs(parser, verbs)
