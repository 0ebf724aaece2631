"""The part of the command line after `--ros-args`: remapping, parameters, log levels."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml
from ros2_embedded import naming


class ArgumentError(ValueError):
    """A ROS argument that cannot be understood."""


class RosYamlLoader(yaml.SafeLoader):
    """YAML as ROS 2 reads it: `1e-3` is a number too."""


RosYamlLoader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(
        r"[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+|[-+]?(\d+\.\d*|\.\d+)|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)"
    ),
    list("-+0123456789."),
)


def load_yaml(text: str) -> Any:
    """Reads YAML.

    Raises:
        ArgumentError: it is none.
    """
    try:
        return yaml.load(text, RosYamlLoader)
    except yaml.YAMLError as error:
        raise ArgumentError(f"not valid YAML: {error}") from error


@dataclass(frozen=True)
class RemapRule:
    """`node:match:=replacement`; without a node it holds for all."""

    match: str
    replacement: str
    node: str | None = None


@dataclass
class RosArguments:
    """What the command line says to ROS."""

    remaps: list[RemapRule] = field(default_factory=list)
    parameters: list[tuple[str, dict[str, Any]]] = field(default_factory=list)
    log_levels: dict[str, str] = field(default_factory=dict)
    remaining: list[str] = field(default_factory=list)

    def node_name(self, name: str) -> str:
        """The node's name after `__node:=` or `__name:=`."""
        return self._special(("__node", "__name"), name) or name

    def namespace(self, name: str, namespace: str) -> str:
        """The namespace after `__ns:=`; `name` is the one that the program gave."""
        return self._special(("__ns",), name) or namespace

    def _special(self, keys: tuple[str, ...], name: str) -> str | None:
        for rule in self.remaps:
            if rule.match in keys and rule.node in (None, name):
                return rule.replacement
        return None

    def resolve(self, name: str, node: str, namespace: str) -> str:
        """Full name of a topic or a service after remapping."""
        full = naming.expand(name, node, namespace)
        for rule in self.remaps:
            if rule.match.startswith("__") or rule.node not in (None, node):
                continue
            if naming.expand(rule.match, node, namespace) == full:
                return naming.expand(rule.replacement, node, namespace)
        return full

    def parameters_for(self, full_name: str) -> dict[str, Any]:
        """Parameter values for a node; what comes later wins."""
        values: dict[str, Any] = {}
        for pattern, parameters in self.parameters:
            if _matches(pattern, full_name):
                values.update(parameters)
        return values


def _matches(pattern: str, full_name: str) -> bool:
    """Whether `/**`, `/ns/*`, `/ns/node` or `node` means the node."""
    if not pattern.startswith("/"):
        pattern = f"/{pattern}"
    expression = ""
    for token in pattern.strip("/").split("/"):
        expression += {"**": "(/[^/]+)*", "*": "/[^/]+"}.get(token, "/" + re.escape(token))
    return re.fullmatch(expression, full_name) is not None


def flatten(tree: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested parameters with dots: `{a: {b: 1}}` is `{"a.b": 1}`."""
    flat: dict[str, Any] = {}
    for key, value in tree.items():
        if isinstance(value, dict):
            flat.update(flatten(value, f"{prefix}{key}."))
        else:
            flat[f"{prefix}{key}"] = value
    return flat


def load_parameter_file(path: str | Path) -> list[tuple[str, dict[str, Any]]]:
    """Reads a parameter file.

    Returns:
        Pairs of a node's name, which may have wildcards, and its parameters.

    Raises:
        ArgumentError: the file is missing or is no parameter file.
    """
    try:
        tree = load_yaml(Path(path).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise ArgumentError(f"Cannot read the parameter file '{path}': {error}") from error
    except ArgumentError as error:
        raise ArgumentError(f"The parameter file '{path}' is {error}") from error
    found: list[tuple[str, dict[str, Any]]] = []

    def walk(node: Any, name: str) -> None:
        if not isinstance(node, dict):
            raise ArgumentError(f"The parameter file '{path}' has no ros__parameters in '{name}'")
        for key, value in node.items():
            if key == "ros__parameters":
                found.append((name or "/**", flatten(value or {})))
            else:
                walk(value, f"{name}/{str(key).strip('/')}")

    walk(tree or {}, "")
    return found


def _parse_remap(rule: str) -> RemapRule:
    match = re.fullmatch(r"(?:(?P<node>[A-Za-z_]\w*):)?(?P<match>[^:=]+):=(?P<to>.+)", rule)
    if match is None:
        raise ArgumentError(f"Couldn't parse remap rule: '-r {rule}'")
    return RemapRule(match["match"], match["to"], match["node"])


def _parse_parameter(rule: str) -> tuple[str, dict[str, Any]]:
    match = re.fullmatch(r"(?:(?P<node>[^:]+):)?(?P<name>[^:=]+):=(?P<value>.*)", rule, re.DOTALL)
    if match is None:
        raise ArgumentError(f"Couldn't parse parameter override rule: '-p {rule}'")
    return match["node"] or "/**", {match["name"]: load_yaml(match["value"])}


def parse_arguments(arguments: Sequence[str]) -> RosArguments:
    """Takes the ROS arguments out of a command line.

    Args:
        arguments: with or without the program's name; the rest comes back in `remaining`.

    Raises:
        ArgumentError: an unknown or incomplete ROS argument.
    """
    parsed = RosArguments()
    ours, items = False, list(arguments)
    while items:
        item = items.pop(0)
        if item == "--ros-args":
            ours = True
        elif not ours:
            parsed.remaining.append(item)
        elif item == "--":
            ours = False
        elif item in ("--enable-rosout-logs", "--disable-rosout-logs", "--disable-stdout-logs",
                      "--enable-stdout-logs", "--disable-external-lib-logs",
                      "--enable-external-lib-logs"):  # fmt: skip
            continue
        elif item not in ("-r", "--remap", "-p", "--param", "--params-file", "--log-level",
                          "-e", "--enclave", "--log-config-file"):  # fmt: skip
            raise ArgumentError(f"Unknown ROS argument: '{item}'")
        elif not items:
            raise ArgumentError(f"Missing value after the ROS argument '{item}'")
        else:
            _take(parsed, item, items.pop(0))
    return parsed


def _take(parsed: RosArguments, option: str, value: str) -> None:
    if option in ("-r", "--remap"):
        parsed.remaps.append(_parse_remap(value))
    elif option in ("-p", "--param"):
        parsed.parameters.append(_parse_parameter(value))
    elif option == "--params-file":
        parsed.parameters.extend(load_parameter_file(value))
    elif option == "--log-level":
        name, _, level = value.rpartition(":=")
        parsed.log_levels[name] = level
