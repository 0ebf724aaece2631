"""Values of parameters from the text that a user gives."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml
from rclpy.parameter import Parameter

from ros2_embedded.cli.common import CliError


def guessed(name: str, text: str) -> Any:
    """A parameter as a message; its type is what YAML takes the text for, or else a string."""
    try:
        value = yaml.safe_load(text)
    except yaml.parser.ParserError:
        value = text
    if value is None:
        value = text
    if isinstance(value, list):
        kinds = {type(item) for item in value}
        if not value:
            return Parameter(name, Parameter.Type.BOOL_ARRAY, []).to_parameter_msg()
        if kinds == {int, bool}:
            value = [int(item) for item in value]
        elif len(kinds) > 1 or not kinds <= {bool, int, float, str}:
            value = text
    elif not isinstance(value, (bool, int, float, str)):
        value = text
    return Parameter(name, value=value).to_parameter_msg()


def from_file(path: str, use_wildcard: bool) -> list[Any]:
    """Parameters of a file as messages, those under `/**` first.

    Raises:
        CliError: the file is no parameter file, or has no parameters.
    """
    tree = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
    nodes = [name for name in tree if name != "/**"]
    if use_wildcard and "/**" in tree:
        nodes.insert(0, "/**")
    if not nodes:
        raise CliError("Param file does not contain selected parameters")
    merged: dict[str, Any] = {}
    for name in nodes:
        if not isinstance(tree[name], dict) or "ros__parameters" not in tree[name]:
            raise CliError(f"YAML file is not a valid ROS parameter file for node {name}")
        merged.update(tree[name]["ros__parameters"])
    return [guessed(name, str(value)) for name, value in _flat(merged, "").items()]


def _flat(tree: dict[str, Any], prefix: str) -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in tree.items():
        if isinstance(value, dict):
            flat.update(_flat(value, f"{prefix}{key}."))
        else:
            flat[f"{prefix}{key}"] = value
    return flat


def nested(flat: dict[str, Any]) -> dict[str, Any]:
    """Names with dots become mappings within mappings."""
    tree: dict[str, Any] = {}
    for name, value in flat.items():
        *groups, last = name.split(".")
        branch = tree
        for group in groups:
            branch = branch.setdefault(group, {})
        branch[last] = value
    return tree
