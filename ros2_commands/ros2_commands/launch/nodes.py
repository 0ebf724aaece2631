"""Make the processes that the entity `node` of a launch file stands for."""

from __future__ import annotations

import json
import os
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

import yaml

from ros2_commands.errors import CommandError
from ros2_commands.launch.substitutions import Scope, substitute
from ros2_commands.packages import executable

CONDITIONS = ("if", "unless")
NAMESPACE = "ros_namespace"  # variable that holds the present namespace, as in ROS 2
_KEYS = {"name", "namespace", "output", "args", "env", "on_exit", "param", "remap"}
_OUTPUTS = ("log", "screen", "both")


@dataclass(frozen=True)
class Process:
    """A process to start.

    Attributes:
        label: What its lines begin with, as `walker-1`.
        command: Its words.
        environment: All of its environment.
        shutdown_on_exit: Whether the launch ends with it.
        on_screen: Whether what it writes to stdout is shown, not only what it writes to stderr.
    """

    label: str
    command: list[str]
    environment: dict[str, str]
    shutdown_on_exit: bool
    on_screen: bool


def check_keys(entity: str, given: dict[str, Any], allowed: set[str], required: set[str]) -> None:
    """Look for what an entity must not or must have.

    Raises:
        CommandError: An attribute is unknown or missing.
    """
    unknown = set(given) - allowed - required - {*CONDITIONS}
    if unknown:
        raise CommandError(f"Unexpected key(s) found in `{entity}`: {sorted(unknown)}")
    if missing := sorted(required - set(given)):
        raise CommandError(f"Can not find attribute '{missing[0]}' in Entity '{entity}'")


def node_process(body: dict[str, Any], scope: Scope, number: int) -> Process:
    """Make the process of a node; `number` counts the processes of the launch from 1.

    Raises:
        CommandError: There is no such package or executable, or the entity makes no sense.
    """
    check_keys("node", body, _KEYS, {"pkg", "exec"})
    name = substitute(body["exec"], scope)
    program = executable(substitute(body["pkg"], scope), name)
    if body.get("on_exit", "shutdown") != "shutdown":
        raise CommandError(f"on_exit of a node can only be shutdown, not {body['on_exit']!r}")
    output = substitute(body.get("output", "log"), scope)
    if output not in _OUTPUTS:
        raise CommandError(f"{output} is not a valid standard output config")
    pairs = ((str(item["name"]), substitute(item["value"], scope)) for item in body.get("env", []))
    arguments = shlex.split(substitute(body.get("args", ""), scope))
    return Process(
        label=f"{name}-{number}",
        command=[str(program), *arguments, "--ros-args", *_ros_arguments(body, scope)],
        # Into a pipe, Python would write only when it ends.
        environment={"PYTHONUNBUFFERED": "1", **os.environ, **dict(pairs)},
        shutdown_on_exit="on_exit" in body,
        on_screen=output != "log",
    )


def push_namespace(body: dict[str, Any], scope: Scope) -> None:
    """Put the following nodes of a scope into a namespace, inside the present one if relative."""
    check_keys("push_ros_namespace", body, set(), {"namespace"})
    scope.variables[NAMESPACE] = _inside(body, scope)


def set_remap(body: dict[str, Any], scope: Scope) -> None:
    """Give the following nodes of a scope a remapping, which goes before their own."""
    check_keys("set_remap", body, set(), {"from", "to"})
    scope.remaps.append(_remapping(body, scope))


def _inside(body: dict[str, Any], scope: Scope) -> str:
    outer = scope.variables.get(NAMESPACE, "/")
    # Absolute, because rcl refuses another one.
    return str(PurePosixPath(outer, substitute(body.get("namespace", ""), scope)))


def _remapping(item: dict[str, Any], scope: Scope) -> str:
    return f"{substitute(item['from'], scope)}:={substitute(item['to'], scope)}"


def _ros_arguments(body: dict[str, Any], scope: Scope) -> Iterator[str]:
    if "name" in body:
        yield from ("-r", f"__node:={substitute(body['name'], scope)}")
    if "namespace" in body or NAMESPACE in scope.variables:
        yield from ("-r", f"__ns:={_inside(body, scope)}")
    for item in body.get("param", []):
        yield from _parameter(item, scope)
    for rule in (*scope.remaps, *(_remapping(item, scope) for item in body.get("remap", []))):
        yield from ("-r", rule)


def _parameter(item: dict[str, Any], scope: Scope) -> tuple[str, str]:
    if "from" in item:
        check_keys("param", item, set(), {"from"})
        file = substitute(item["from"], scope)
        if not Path(file).is_file():  # each node would say so in its own words
            raise CommandError(f"{file}: there is no such parameter file")
        return "--params-file", file
    check_keys("param", item, set(), {"name", "value"})
    return "-p", f"{substitute(item['name'], scope)}:={_value(item['value'], scope)}"


def _value(given: Any, scope: Scope) -> str:
    """Write a parameter's value for the command line; a text has the type that YAML sees in it."""
    if isinstance(given, list):
        return f"[{', '.join(_value(each, scope) for each in given)}]"
    if not isinstance(given, str):
        return json.dumps(given)
    text = substitute(given, scope)
    try:
        found = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError):  # int() refuses thousands of digits
        found = text
    if isinstance(found, float):
        return text  # JSON has no .inf
    return json.dumps(found if isinstance(found, (bool, int, list)) else text)
