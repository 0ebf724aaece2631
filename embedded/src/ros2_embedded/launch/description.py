"""Launch files in YAML, read into a list of processes."""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rclpy.arguments import ArgumentError, load_yaml

from ros2_embedded.entry_points import PackageError, executables
from ros2_embedded.launch.errors import LaunchError
from ros2_embedded.launch.substitutions import Scope, is_true, substitute


@dataclass(frozen=True)
class Argument:
    """An argument of a launch file."""

    name: str
    default: str | None
    description: str
    choices: tuple[str, ...] = ()
    conditional: bool = False


@dataclass(frozen=True)
class ProcessSpec:
    """A process to start."""

    label: str
    command: list[str]
    environment: dict[str, str]
    cwd: str | None = None
    shutdown_on_exit: bool = False


@dataclass
class LaunchPlan:
    """What a launch file, with the files that it includes, comes down to."""

    processes: list[ProcessSpec] = field(default_factory=list)
    arguments: dict[str, Argument] = field(default_factory=dict)
    messages: list[str] = field(default_factory=list)


_COMMON = {"if", "unless"}
_PROCESS_KEYS = {"name", "output", "args", "env", "on_exit", "launch-prefix", "cwd", "emulate_tty",
                 "sigterm_timeout", "sigkill_timeout"}  # fmt: skip


def _check_keys(entity: str, given: dict[str, Any], allowed: set[str], required: set[str]) -> None:
    unknown = set(given) - allowed - required - _COMMON
    if unknown:
        raise LaunchError(f"'{entity}' has unknown attributes: {', '.join(sorted(unknown))}")
    missing = required - set(given)
    if missing:
        raise LaunchError(f"'{entity}' lacks: {', '.join(sorted(missing))}")


class LaunchReader:
    """Reads launch files; `plan` is what has been read."""

    def __init__(self, only_arguments: bool = False) -> None:
        """With `only_arguments` a missing argument is no error and no processes are collected."""
        self.plan = LaunchPlan()
        self._only_arguments = only_arguments
        self._handlers: dict[str, Callable[[Any, Scope], None]] = {
            "arg": self._arg,
            "let": self._let,
            "set_env": self._set_env,
            "node": self._node,
            "executable": self._executable,
            "include": self._include,
            "group": self._group,
            "push_ros_namespace": self._push_namespace,
            "push-ros-namespace": self._push_namespace,
            "log": self._log,
        }

    def read(self, path: Path, scope: Scope) -> None:
        """Reads one file.

        Raises:
            LaunchError: the file is missing or makes no sense.
        """
        try:
            tree = load_yaml(path.read_text(encoding="utf-8"))
        except (OSError, ArgumentError, UnicodeDecodeError) as error:
            raise LaunchError(f"{path}: {error}") from error
        if not isinstance(tree, dict) or not isinstance(tree.get("launch"), list):
            raise LaunchError(f"{path}: a list under 'launch' expected")
        try:
            self._entities(tree["launch"], scope)
        except LaunchError as error:
            if str(path) in str(error):
                raise
            raise LaunchError(f"{path}: {error}") from error

    def _entities(self, entities: list[Any], scope: Scope) -> None:
        for entity in entities:
            if not isinstance(entity, dict) or len(entity) != 1:
                raise LaunchError(f"{entity!r} is no launch entity")
            kind, body = next(iter(entity.items()))
            handler = self._handlers.get(kind)
            if handler is None:
                known = ", ".join(sorted(self._handlers))
                raise LaunchError(f"unknown entity '{kind}'; there are: {known}")
            if isinstance(body, dict):
                if "if" in body and not self._condition(body["if"], scope):
                    continue
                if "unless" in body and self._condition(body["unless"], scope):
                    continue
            elif kind != "group":
                raise LaunchError(f"'{kind}' needs attributes, not {body!r}")
            handler(body, scope)

    def _condition(self, text: Any, scope: Scope) -> bool:
        try:
            return is_true(substitute(text, scope))
        except LaunchError:
            if self._only_arguments:  # an argument may be missing: look inside
                return True
            raise

    # Arguments and variables.

    def _arg(self, body: dict[str, Any], scope: Scope) -> None:
        _check_keys("arg", body, {"default", "description", "choice", "choices"}, {"name"})
        name = str(body["name"])
        default = substitute(body["default"], scope) if "default" in body else None
        raw = body.get("choice", body.get("choices", []))
        choices = tuple(str(c["value"] if isinstance(c, dict) else c) for c in raw)
        description = str(body.get("description", "no description given"))
        self.plan.arguments.setdefault(name, Argument(name, default, description, choices))
        if name not in scope.variables:
            if default is None:
                if self._only_arguments:
                    return
                raise LaunchError(f"missing required argument '{name}' ({description})")
            scope.variables[name] = default
        value = scope.variables[name]
        if choices and value not in choices:
            raise LaunchError(
                f"argument '{name}' is '{value}': one of {', '.join(choices)} expected"
            )

    def _let(self, body: dict[str, Any], scope: Scope) -> None:
        _check_keys("let", body, set(), {"name", "value"})
        scope.variables[str(body["name"])] = substitute(body["value"], scope)

    def _set_env(self, body: dict[str, Any], scope: Scope) -> None:
        _check_keys("set_env", body, set(), {"name", "value"})
        scope.environment[str(body["name"])] = substitute(body["value"], scope)

    def _push_namespace(self, body: dict[str, Any], scope: Scope) -> None:
        _check_keys("push_ros_namespace", body, set(), {"namespace"})
        scope.namespace = _join(scope.namespace, substitute(body["namespace"], scope))

    def _log(self, body: dict[str, Any], scope: Scope) -> None:
        _check_keys("log", body, {"level"}, {"message"})
        self.plan.messages.append(substitute(body["message"], scope))

    # Files and groups.

    def _include(self, body: dict[str, Any], scope: Scope) -> None:
        _check_keys("include", body, {"arg", "let"}, {"file"})
        path = Path(substitute(body["file"], scope))
        # Variables of the including file are seen by the included one, as in ROS 2.
        inner = scope.inner()
        inner.file = path
        for item in [*body.get("arg", []), *body.get("let", [])]:
            inner.variables[str(item["name"])] = substitute(item["value"], scope)
        self.read(path, inner)

    def _group(self, body: Any, scope: Scope) -> None:
        if isinstance(body, dict):
            _check_keys("group", body, {"scoped"}, {"children"})
            scoped = is_true(substitute(body.get("scoped", "true"), scope))
            self._entities(body["children"], scope.inner() if scoped else scope)
        else:
            self._entities(body, scope.inner())

    # Processes.

    def _node(self, body: dict[str, Any], scope: Scope) -> None:
        _check_keys("node", body, {"namespace", "param", "remap", *_PROCESS_KEYS}, {"pkg", "exec"})
        if self._only_arguments:
            return
        package, executable = substitute(body["pkg"], scope), substitute(body["exec"], scope)
        try:
            known = executables(package)
        except PackageError as error:
            raise LaunchError(str(error)) from error
        if executable not in known:
            raise LaunchError(f"executable '{executable}' not found in the package '{package}'")
        ros: list[str] = []
        if "name" in body:
            ros += ["-r", f"__node:={substitute(body['name'], scope)}"]
        namespace = _join(scope.namespace, substitute(body.get("namespace", ""), scope))
        if namespace:
            ros += ["-r", f"__ns:={namespace}"]
        for remap in body.get("remap", []):
            ros += ["-r", f"{substitute(remap['from'], scope)}:={substitute(remap['to'], scope)}"]
        ros += self._parameters(body.get("param", []), "", scope)
        command = [sys.executable, "-m", "ros2_embedded.executable", package, executable]
        command += shlex.split(substitute(body.get("args", ""), scope))
        self._add(body, scope, executable, command + (["--ros-args", *ros] if ros else []))

    def _parameters(self, items: list[Any], prefix: str, scope: Scope) -> list[str]:
        options: list[str] = []
        for item in items:
            if "from" in item:
                options += ["--params-file", substitute(item["from"], scope)]
            elif "param" in item:
                options += self._parameters(item["param"], f"{prefix}{item['name']}.", scope)
            else:
                _check_keys("param", item, {"type"}, {"name", "value"})
                value = item["value"]
                if isinstance(value, str):
                    value = substitute(value, scope)
                    if item.get("type") != "str":
                        value = load_yaml(value) if value else ""
                name = f"{prefix}{substitute(item['name'], scope)}"
                options += ["-p", f"{name}:={json.dumps(value)}"]
        return options

    def _executable(self, body: dict[str, Any], scope: Scope) -> None:
        _check_keys("executable", body, {"shell", *_PROCESS_KEYS}, {"cmd"})
        if self._only_arguments:
            return
        text = substitute(body["cmd"], scope)
        command = shlex.split(text) + shlex.split(substitute(body.get("args", ""), scope))
        if is_true(substitute(body.get("shell", "false"), scope)):
            command = ["/bin/sh", "-c", text]
        if not command:
            raise LaunchError("'executable' has an empty cmd")
        name = substitute(body["name"], scope) if "name" in body else Path(command[0]).name
        self._add(body, scope, name, command)

    def _add(self, body: dict[str, Any], scope: Scope, name: str, command: list[str]) -> None:
        environment = dict(scope.environment)
        for item in body.get("env", []):
            environment[str(item["name"])] = substitute(item["value"], scope)
        on_exit = body.get("on_exit", "")
        if on_exit not in ("", "shutdown"):
            raise LaunchError(f"on_exit is '{on_exit}': only 'shutdown' is supported")
        prefix = shlex.split(substitute(body.get("launch-prefix", ""), scope))
        cwd = substitute(body["cwd"], scope) if "cwd" in body else None
        label = f"{name}-{len(self.plan.processes) + 1}"
        self.plan.processes.append(
            ProcessSpec(label, prefix + command, environment, cwd, on_exit == "shutdown")
        )


def _join(namespace: str, name: str) -> str:
    if not name or name.startswith("/"):
        return name or namespace
    return f"{namespace.rstrip('/')}/{name}"


def read_launch_file(path: Path, arguments: dict[str, str]) -> LaunchPlan:
    """Reads a launch file with its arguments.

    Raises:
        LaunchError: the file makes no sense, or an argument is unknown or missing.
    """
    reader = LaunchReader()
    reader.read(path, Scope(path, dict(arguments)))
    unknown = sorted(set(arguments) - set(reader.plan.arguments))
    if unknown:
        known = ", ".join(reader.plan.arguments) or "none"
        raise LaunchError(f"unknown launch argument '{unknown[0]}'; there are: {known}")
    return reader.plan


def read_arguments(path: Path) -> list[Argument]:
    """Arguments that a launch file and those that it includes declare."""
    reader = LaunchReader(only_arguments=True)
    reader.read(path, Scope(path))
    return list(reader.plan.arguments.values())
