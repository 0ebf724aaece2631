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

from ros2_embedded.cli.common import CliError, Verb, define_verbs, flag, option
from ros2_embedded.entry_points import PackageError, executables


def _list(options: argparse.Namespace) -> None:
    for name in sorted(get_packages_with_prefixes()):
        print(name)


def _prefix(options: argparse.Namespace) -> str | None:
    find = get_package_share_directory if options.share else get_package_prefix
    try:
        print(find(options.package_name))
    except (PackageNotFoundError, ValueError):
        return "Package not found"
    return None


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


_NAME = option("package_name", help="The package name")
_VERBS = {
    "executables": Verb(
        "Output a list of package specific executables",
        _executables,
        option("package_name", nargs="?", help="The package name"),
        flag("--full-path", text="Show full path of each executable"),
    ),
    "list": Verb("Output a list of available packages", _list),
    "prefix": Verb(
        "Output the prefix path of a package",
        _prefix,
        _NAME,
        flag("--share", text="Show share directory for the package"),
    ),
    "xml": Verb(
        "Output the XML of the package manifest or a specific tag",
        _xml,
        _NAME,
        option("-t", "--tag", help="The XML tag to output (e.g. 'version')"),
    ),
}


def define(parser: argparse.ArgumentParser) -> None:
    """Adds the verbs of `ros2 pkg`."""
    define_verbs(parser, _VERBS)
