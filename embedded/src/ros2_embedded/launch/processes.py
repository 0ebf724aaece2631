"""Processes of a launch file: nodes and other executables."""

from __future__ import annotations

import json
import re
import shlex
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from ros2_embedded.entry_points import PackageError, executables
from ros2_embedded.launch.errors import LaunchError
from ros2_embedded.launch.substitutions import Scope, substitute, truth

CONDITIONS = ("if", "unless")
_PROCESS_KEYS = {"name", "output", "args", "env", "on_exit", "launch-prefix", "cwd", "emulate_tty",
                 "sigterm_timeout", "sigkill_timeout"}  # fmt: skip
_NODE_KEYS = {"namespace", "param", "remap", "exec_name", "ros_args"}
OUTPUTS = ("log", "screen", "both", "own_log", "full")


@dataclass(frozen=True)
class ProcessSpec:
    """A process to start; `output` is one of OUTPUTS."""

    label: str
    command: list[str]
    environment: dict[str, str]
    cwd: str | None = None
    shutdown_on_exit: bool = False
    output: str = "log"


def check_keys(entity: str, given: dict[str, Any], allowed: set[str], required: set[str]) -> None:
    """Looks for what an entity must not or must have.

    Raises:
        LaunchError: an unknown attribute, or one that is missing.
    """
    unknown = set(given) - allowed - required - set(CONDITIONS)
    if unknown:
        raise LaunchError(f"Unexpected key(s) found in `{entity}`: {unknown}")
    for name in sorted(required - set(given)):
        raise LaunchError(f"Can not find attribute '{name}' in Entity '{entity}'")


def join(namespace: str, name: str) -> str:
    """A namespace, or a name, within a namespace."""
    if not name or name.startswith("/"):
        return name or namespace
    return f"{namespace.rstrip('/')}/{name}"


def node_process(body: dict[str, Any], scope: Scope, number: int) -> ProcessSpec:
    """The process that an entity `node` starts.

    Raises:
        LaunchError: there is no such package or executable, or the entity makes no sense.
    """
    check_keys("node", body, _NODE_KEYS | _PROCESS_KEYS, {"pkg", "exec"})
    package, executable = substitute(body["pkg"], scope), substitute(body["exec"], scope)
    try:
        known = executables(package)
    except PackageError as error:
        raise LaunchError(str(error)) from error
    if executable not in known:
        raise LaunchError(f"executable '{executable}' not found in the package '{package}'")
    command = [sys.executable, "-m", "ros2_embedded.executable", package, executable]
    command += shlex.split(substitute(body.get("args", ""), scope))
    if "ros_args" in body:
        command += ["--ros-args", *shlex.split(substitute(body["ros_args"], scope)), "--"]
    command.append("--ros-args")
    if "name" in body:
        command += ["-r", f"__node:={substitute(body['name'], scope)}"]
    namespace = join(scope.namespace, substitute(body.get("namespace", ""), scope))
    if namespace:
        command += ["-r", f"__ns:={join('', '/' + namespace.lstrip('/'))}"]
    command += scope.parameters + parameter_options(body.get("param", []), "", scope)
    own = [
        (substitute(r["from"], scope), substitute(r["to"], scope)) for r in body.get("remap", [])
    ]
    for source, target in scope.remaps + own:
        command += ["-r", f"{source}:={target}"]
    name = substitute(body["exec_name"], scope) if "exec_name" in body else executable
    return _process(body, scope, f"{name}-{number}", command, executable)


def parameter_options(items: list[Any], prefix: str, scope: Scope) -> list[str]:
    """Options of the command line for the parameters of a node."""
    options: list[str] = []
    for item in items:
        if "from" in item:
            check_keys("param", item, {"allow_substs"}, {"from"})
            options += ["--params-file", substitute(item["from"], scope)]
        elif "param" in item:
            name = substitute(item["name"], scope)
            options += parameter_options(item["param"], f"{prefix}{name}.", scope)
        else:
            check_keys("param", item, {"type"}, {"name", "value"})
            name = f"{prefix}{substitute(item['name'], scope)}"
            options += ["-p", f"{name}:={_value(item, scope)}"]
    return options


_TYPES: dict[str, Callable[[str], Any]] = {"str": str, "int": int, "float": float, "bool": truth}


def _value(item: dict[str, Any], scope: Scope) -> str:
    """A parameter's value in YAML, of the type that the file names, or that YAML sees in it."""
    given, kind = item["value"], item.get("type")
    values = given if isinstance(given, list) else [given]
    texts = [substitute(v, scope) if isinstance(v, str) else json.dumps(v) for v in values]
    if kind is None:
        parts = [text if _is_yaml(text) else json.dumps(text) for text in texts]
        return f"[{', '.join(parts)}]" if isinstance(given, list) else parts[0]
    element = re.sub(r"^list_of_(.*)s$", r"\1", kind)
    if element not in _TYPES:
        raise LaunchError(f"Unknown type '{kind}' of the parameter '{item['name']}'")
    if element != kind and not isinstance(given, list):
        texts = [str(value) for value in yaml.safe_load(texts[0])]
    try:
        found = [_TYPES[element](text) for text in texts]
    except ValueError as error:
        raise LaunchError(f"the parameter '{item['name']}' is no {kind}: {error}") from error
    return json.dumps(found if element != kind else found[0])


def _is_yaml(text: str) -> bool:
    try:
        return yaml.safe_load(text) is not None
    except yaml.YAMLError:
        return False


def executable_process(body: dict[str, Any], scope: Scope, number: int) -> ProcessSpec:
    """The process that an entity `executable` starts.

    Raises:
        LaunchError: the entity makes no sense.
    """
    check_keys("executable", body, {"shell", *_PROCESS_KEYS}, {"cmd"})
    text = substitute(body["cmd"], scope)
    command = shlex.split(text) + shlex.split(substitute(body.get("args", ""), scope))
    if not command:
        raise LaunchError("'executable' has an empty cmd")
    program = Path(command[0]).name
    name = substitute(body["name"], scope) if "name" in body else program
    if truth(substitute(str(body.get("shell", "false")), scope)):
        command = ["/bin/sh", "-c", text]
    return _process(body, scope, f"{name}-{number}", command, program)


def _process(
    body: dict[str, Any], scope: Scope, label: str, command: list[str], program: str
) -> ProcessSpec:
    environment = dict(scope.environment)
    for item in body.get("env", []):
        environment[str(item["name"])] = substitute(item["value"], scope)
    on_exit = body.get("on_exit", "")
    if on_exit not in ("", "shutdown"):
        raise LaunchError(
            f"Attribute on_exit of Entity node expected to be shutdown but got `{on_exit}`"
        )
    output = substitute(body.get("output", "log"), scope)
    output = environment.get("OVERRIDE_LAUNCH_PROCESS_OUTPUT", output)
    if output not in OUTPUTS:
        raise LaunchError(f"{output} is not a valid standard output config")
    return ProcessSpec(
        label,
        _prefix(body, scope, program) + command,
        environment,
        substitute(body["cwd"], scope) if "cwd" in body else None,
        on_exit == "shutdown",
        output,
    )


def _prefix(body: dict[str, Any], scope: Scope, program: str) -> list[str]:
    """The prefix of a command: the entity's, or that of the whole launch if its filter matches."""
    if "launch-prefix" in body:
        return shlex.split(substitute(body["launch-prefix"], scope))
    if re.match(scope.variables.get("launch-prefix-filter", ""), program):
        return shlex.split(scope.variables.get("launch-prefix", ""))
    return []
