"""`ros2 interface`: show, list."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from ros2_embedded.catalogue import KINDS, full_name, interface_text, list_interfaces, list_packages
from ros2_embedded.cli.common import run
from ros2_embedded.specs import InterfaceError, parse_message


def _define_show(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("type", help="as in sensor_msgs/msg/JointState")
    parser.add_argument("--no-comments", action="store_true", help="leave comments out")


def _expanded(name: str, text: str, depth: int, comments: bool) -> list[str]:
    """Lines of a definition; below a field of another type stand that type's fields, indented."""
    lines = []
    package = name.split("/")[0]
    for raw in text.splitlines():
        line = raw if comments else raw.split("#")[0].rstrip()
        if not line.strip() and not (comments and depth == 0):
            continue
        lines.append("\t" * depth + line)
        if raw.strip() == "---" or not raw.split("#")[0].strip():
            continue
        for field in parse_message(f"{package}/msg/Line", raw).fields:
            if not field.type.primitive:
                inner = field.type.base
                lines += _expanded(inner, interface_text(inner), depth + 1, False)
    return lines


def _show(options: argparse.Namespace) -> None:
    """Output the interface definition."""
    name = _complete(options.type)
    print("\n".join(_expanded(name, interface_text(name), 0, not options.no_comments)))


def _complete(name: str) -> str:
    """Full name; of `pkg/Name` the kind is looked up."""
    parts = name.split("/")
    if len(parts) == 2:
        for kind in KINDS:
            if parts[1] in list_interfaces(parts[0], kind):
                return f"{parts[0]}/{kind}/{parts[1]}"
        raise InterfaceError(f"Unknown interface '{name}'")
    return full_name(name, "msg")


def _define_list(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("package", nargs="?", help="only this package's")


def _list(options: argparse.Namespace) -> None:
    """List all interface types available."""
    packages = [options.package] if options.package else list_packages()
    titles = {"msg": "Messages:", "srv": "Services:", "action": "Actions:"}
    for kind, title in titles.items():
        print(title)
        for package in packages:
            for short in list_interfaces(package, kind):
                print(f"    {package}/{kind}/{short}")


def main(arguments: Sequence[str]) -> int:
    """Runs `ros2 interface ...`."""
    verbs = {"show": (_define_show, _show), "list": (_define_list, _list)}
    return run("interface", "Show information about ROS interfaces.", verbs, arguments)
