"""`ros2 interface`: list, package and show."""

from __future__ import annotations

import argparse
import re
import sys

from ament_index_python.resources import get_resource, get_resources

from ros2_commands.errors import CommandError
from ros2_commands.options import Verbs
from ros2_commands.packages import share

_TITLES = {"msg": "Messages:", "srv": "Services:", "action": "Actions:"}
_PRIMITIVE = {"bool", "byte", "char", "float32", "float64", "string", "wstring"} | {
    f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)
}
_FIELD = re.compile(r"(?P<type>[A-Za-z][\w/]*)\S*\s+(?P<name>[a-z]\w*)(?!\s*=)\b")


def _list(options: argparse.Namespace) -> None:
    """List the types of all packages."""
    only = [kind for kind in _TITLES if getattr(options, kind)]
    for kind in only or _TITLES:
        print(_TITLES[kind])
        for package in sorted(get_resources("rosidl_interfaces")):
            lines = get_resource("rosidl_interfaces", package)[0].splitlines()
            for name in sorted({line.rpartition(".")[0] for line in lines}):
                if name.startswith(f"{kind}/"):
                    print(f"    {package}/{name}")


def _package(options: argparse.Namespace) -> None:
    """List the types of a package."""
    lines = get_resource("rosidl_interfaces", share(options.package).name)[0].splitlines()
    for name in sorted({line.rpartition(".")[0] for line in lines}):
        if name.startswith(tuple(f"{kind}/" for kind in _TITLES)):
            print(f"{options.package}/{name}")


def _show(options: argparse.Namespace) -> None:
    """Print the definition of a type, each type within it indented below its field."""
    name = sys.stdin.readline().strip() if options.type == "-" else options.type
    print("\n".join(_lines(name, not options.no_comments, options.all_comments)))


def _lines(name: str, comments: bool, nested_comments: bool, depth: int = 0) -> list[str]:
    lines = []
    for raw in _definition(name).splitlines():
        text = raw.rstrip() if comments else raw.partition("#")[0].rstrip()
        if text or comments:
            lines.append("\t" * depth + text if text else "")
        if inner := _type_within(raw, name.split("/")[0]):
            lines += _lines(inner, nested_comments, nested_comments, depth + 1)
    return lines


def _type_within(line: str, package: str) -> str | None:
    """Name the message type of a field, unless the line has no field or a primitive one."""
    field = _FIELD.match(line)
    if field is None or field["type"] in _PRIMITIVE:
        return None
    owner, _, short = field["type"].rpartition("/")
    return f"{owner or package}/msg/{short}"


def _definition(name: str) -> str:
    package, _, rest = name.partition("/")
    if rest.count("/") != 1:
        raise CommandError(f"Invalid name '{name}'. Expected three parts separated by '/'")
    kind = rest.partition("/")[0]
    path = share(package) / f"{rest}.{kind}"
    if not path.is_file():
        raise CommandError(f"Could not find the interface '{path}'")
    return path.read_text(encoding="utf-8")


def define(parser: argparse.ArgumentParser) -> None:
    """Add the verbs to the command's parser."""
    verbs = Verbs(parser)
    listing = verbs.add("list", _list)
    for kind, title in _TITLES.items():
        word = title.rstrip(":").lower()
        listing.add_argument(f"-{kind[0]}", f"--only-{kind}s", dest=kind, action="store_true",
                             help=f"only {word}")  # fmt: skip
    verbs.add("package", _package).add_argument("package")
    show = verbs.add("show", _show)
    show.add_argument("type", help="as std_msgs/msg/String; - reads it from standard input")
    which = show.add_mutually_exclusive_group()
    which.add_argument("--all-comments", action="store_true", help="those of types within, too")
    which.add_argument("--no-comments", action="store_true", help="no comments, no empty lines")
