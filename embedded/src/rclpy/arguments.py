"""The part of the command line after `--ros-args`: remapping, parameters, log levels."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rclpy.exceptions import UnknownROSArgsError
from rclpy.names import expand_topic_name
from rclpy.yaml_values import ArgumentError, load_parameters


@dataclass(frozen=True)
class RemapRule:
    """A rule `node:match:=replacement`; without a node it is for all, without a kind for both."""

    match: str
    replacement: str
    node: str | None = None
    kind: str = ""


@dataclass
class RosArguments:
    """The ROS arguments of a command line."""

    remaps: list[RemapRule] = field(default_factory=list)
    parameters: list[tuple[str, dict[str, Any]]] = field(default_factory=list)
    log_levels: dict[str, str] = field(default_factory=dict)
    flags: dict[str, bool] = field(default_factory=dict)
    remaining: list[str] = field(default_factory=list)

    def node_name(self, name: str) -> str:
        """The node's name after `__node:=` or `__name:=`."""
        return self._special(("__node", "__name"), name) or name

    def namespace(self, name: str, namespace: str) -> str:
        """The namespace after `__ns:=`; `name` is the one after remapping."""
        return self._special(("__ns",), name) or namespace

    def _special(self, keys: tuple[str, ...], name: str) -> str | None:
        for rule in self.remaps:
            if rule.match in keys and rule.node in (None, name):
                return rule.replacement
        return None

    def remap(self, full: str, node: str, namespace: str, kind: str = "topic") -> str:
        """Name of a topic or a service after remapping; `full` is its name before."""
        for rule in self.remaps:
            if rule.match.startswith("__") or rule.node not in (None, node):
                continue
            if rule.kind in ("", kind) and _expanded(rule.match, node, namespace) == full:
                return expand_topic_name(rule.replacement, node, namespace)
        return full

    def parameters_for(self, full_name: str) -> dict[str, Any]:
        """The parameter values of a node; a pattern has the priority of its first mention."""
        merged: dict[str, dict[str, Any]] = {}
        for pattern, parameters in self.parameters:
            merged.setdefault(pattern, {}).update(parameters)
        values: dict[str, Any] = {}
        for pattern, parameters in merged.items():
            if _matches(pattern, full_name):
                values.update(parameters)
        return values


def _expanded(name: str, node: str, namespace: str) -> str | None:
    try:
        return expand_topic_name(name, node, namespace)
    except ValueError:
        return None


def _matches(pattern: str, full_name: str) -> bool:
    """Whether a pattern such as `/**`, `/ns/*`, `/ns/node` or `node` matches the node."""
    if not pattern.startswith("/"):
        pattern = f"/{pattern}"
    expression = ""
    for token in pattern.strip("/").split("/"):
        expression += {"**": "(/[^/]+)*", "*": "/[^/]+"}.get(token, "/" + re.escape(token))
    return re.fullmatch(expression, full_name) is not None


def flatten(tree: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Flattens nested parameters: `{a: {b: 1}}` becomes `{"a.b": 1}`."""
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
        ArgumentError: The file is missing or is no parameter file.
    """
    try:
        tree = load_parameters(Path(path).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise ArgumentError(f"Cannot read the parameter file '{path}': {error}") from error
    except ArgumentError as error:
        raise ArgumentError(f"The parameter file '{path}' is {error}") from error
    found: list[tuple[str, dict[str, Any]]] = []

    def walk(node: Any, name: str) -> None:
        if not isinstance(node, dict):
            raise ArgumentError(f"The parameter file '{path}' has no ros__parameters in '{name}'")
        for key, value in node.items():
            if key == "ros__parameters" and isinstance(value, (dict, type(None))):
                found.append((name or "/**", flatten(value or {})))
            else:
                walk(value, f"{name}/{str(key).strip('/')}")

    walk(tree or {}, "")
    return found


_TOKEN = r"[A-Za-z_]\w*"
_REMAP = re.compile(
    rf"(?:(?P<node>{_TOKEN}):(?!//))?(?:(?P<special>__node|__name|__ns)|"
    r"(?:ros(?P<kind>topic|service)://)?(?P<match>[\w/~{}]+)):=(?P<to>[\w/~{}]+)",
    re.ASCII,
)


def _parse_remap(option: str, rule: str) -> RemapRule:
    match = _REMAP.fullmatch(rule)
    wanted = {"__ns": "/.*", "__node": _TOKEN, "__name": _TOKEN}
    if match is None or not re.fullmatch(wanted.get(match["special"], ".*"), match["to"]):
        raise ArgumentError(f"Couldn't parse remap rule: '{option} {rule}'.")
    name = match["special"] or match["match"]
    return RemapRule(name, match["to"], match["node"], match["kind"] or "")


def _parse_parameter(option: str, rule: str) -> tuple[str, dict[str, Any]]:
    match = re.fullmatch(r"(?:(?P<node>[^:]+):)?(?P<name>[^:=]+):=(?P<value>.*)", rule, re.DOTALL)
    wrong = f"Couldn't parse parameter override rule: '{option} {rule}'."
    if match is None:
        raise ArgumentError(wrong)
    try:
        value = load_parameters(match["value"])
    except ArgumentError as error:
        raise ArgumentError(f"{wrong} Error: {error}") from error
    node = match["node"] or "/**"
    return node if node.startswith("/") else f"/{node}", flatten({match["name"]: value})


def _parse_log_level(option: str, rule: str) -> tuple[str, str]:
    name, separator, level = rule.rpartition(":=")
    wrong = f"Couldn't parse log level: '{option} {rule}'. Error: "
    if separator and not name:
        raise ArgumentError(wrong + "Argument has an invalid logger item that name is empty")
    if level.upper() not in ("UNSET", "DEBUG", "INFO", "WARN", "ERROR", "FATAL"):
        raise ArgumentError(wrong + "Argument does not use a valid severity level")
    return name, level


_FLAG = re.compile(r"--(enable|disable)-(rosout|stdout|external-lib)-logs")
_TRAILING = {
    "-r": "remap rule found", "--remap": "remap rule found",
    "-p": "parameter override rule found", "--param": "parameter override rule found",
    "--params-file": "file path provided", "--log-level": "log level provided",
    "--log-config-file": "file path provided", "--log-file-name": "string prefix provided",
    "-e": "enclave path provided", "--enclave": "enclave path provided",
}  # fmt: skip


def parse_arguments(arguments: Sequence[str]) -> RosArguments:
    """Parses the ROS arguments of a command line.

    Args:
        arguments: Command line, with or without the program's name; `remaining` has the others.

    Raises:
        ArgumentError: A ROS argument is invalid, or its value is missing.
        UnknownROSArgsError: An argument after `--ros-args` is unknown to ROS.
    """
    parsed = RosArguments()
    unknown: list[str] = []
    ours, items = False, list(arguments)
    while items:
        item = items.pop(0)
        flag = _FLAG.fullmatch(item)
        if item == "--ros-args":
            ours = True
        elif not ours:
            parsed.remaining.append(item)
        elif item == "--":
            ours = False
        elif flag:
            parsed.flags[flag[2]] = flag[1] == "enable"
        elif item not in _TRAILING:
            unknown.append(item)
        elif not items:
            raise ArgumentError(f"Couldn't parse trailing {item} flag. No {_TRAILING[item]}.")
        else:
            _take(parsed, item, items.pop(0))
    if unknown:
        raise UnknownROSArgsError(repr(unknown))
    return parsed


def _take(parsed: RosArguments, option: str, value: str) -> None:
    if option in ("-r", "--remap"):
        parsed.remaps.append(_parse_remap(option, value))
    elif option in ("-p", "--param"):
        parsed.parameters.append(_parse_parameter(option, value))
    elif option == "--params-file":
        try:
            parsed.parameters.extend(load_parameter_file(value))
        except ArgumentError as error:
            raise ArgumentError(
                f"Couldn't parse params file: '{option} {value}'. Error: {error}"
            ) from error
    elif option == "--log-level":
        name, level = _parse_log_level(option, value)
        parsed.log_levels[name] = level
