"""Launch files in YAML, read into a list of processes."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import yaml

from ros2_embedded.launch.errors import LaunchError
from ros2_embedded.launch.processes import (
    CONDITIONS,
    ProcessSpec,
    check_keys,
    executable_process,
    join,
    node_process,
    parameter_options,
)
from ros2_embedded.launch.substitution_parser import describe, parse
from ros2_embedded.launch.substitutions import Scope, is_true, substitute, truth


@dataclass(frozen=True)
class Argument:
    """An argument of a launch file; `default` and `description` as they are shown."""

    name: str
    default: str | None
    description: str
    conditional: bool = False


@dataclass
class LaunchPlan:
    """The processes, arguments and messages of a launch file and of the files that it includes."""

    processes: list[ProcessSpec] = field(default_factory=list)
    arguments: dict[str, Argument] = field(default_factory=dict)
    messages: list[str] = field(default_factory=list)


class LaunchReader:
    """Reads launch files; `plan` is what has been read."""

    def __init__(self, only_arguments: bool = False) -> None:
        """With `only_arguments`, a missing argument is no error, and no processes are collected."""
        self.plan = LaunchPlan()
        self._only_arguments = only_arguments
        self._conditional = 0
        self._handlers: dict[str, Callable[[Any, Scope], None]] = {
            "arg": self._arg,
            "let": self._let,
            "set_env": self._set_env,
            "unset_env": self._unset_env,
            "set_remap": self._set_remap,
            "set_parameter": self._set_parameter,
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
            text = path.read_text(encoding="utf-8")
            if path.suffix == ".py" or text.lstrip().startswith("<"):
                language = "Python" if path.suffix == ".py" else "XML"
                raise LaunchError(
                    f"{path}: launch files in {language} are not supported here, only in YAML"
                )
            tree = yaml.safe_load(text)
        except (OSError, yaml.YAMLError, UnicodeDecodeError) as error:
            raise LaunchError(f"{path}: {error}") from error
        if not isinstance(tree, dict) or not isinstance(tree.get("launch"), list):
            raise LaunchError(f"{path}: Expected 'launch' as root tag")
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
                raise LaunchError(f"Unrecognized entity of the type: {kind}")
            if not isinstance(body, dict) and kind != "group":
                raise LaunchError(f"'{kind}' needs attributes, not {body!r}")
            conditions = (
                [] if isinstance(body, list) else [key for key in CONDITIONS if key in body]
            )
            if self._only_arguments:
                if kind in ("arg", "group", "include"):
                    self._conditional += bool(conditions)
                    handler(body, scope)
                    self._conditional -= bool(conditions)
            elif all(is_true(substitute(body[key], scope)) == (key == "if") for key in conditions):
                handler(body, scope)

    # Arguments and variables.

    def _arg(self, body: dict[str, Any], scope: Scope) -> None:
        check_keys("arg", body, {"default", "description", "choice"}, {"name"})
        name = str(body["name"])
        default = parse(str(body["default"])) if "default" in body else None
        raw = body.get("choice", [])
        choices = [str(choice["value"]) for choice in raw]
        description = str(body.get("description", "no description given"))
        if choices and "description" in body:
            description += (
                f"{'' if description.endswith('.') else '.'} Valid choices are: {choices}"
            )
        elif choices:
            description = f"One of: {choices}"
        shown = None if default is None else describe(default)
        argument = Argument(name, shown, description, self._conditional > 0)
        self.plan.arguments.setdefault(name, argument)
        if self._only_arguments:
            return
        if name not in scope.variables:
            if default is None:
                given = ", ".join(scope.variables)
                raise LaunchError(
                    f"Included launch description missing required argument '{name}' "
                    f"(description: '{description}'), given: [{given}]"
                )
            scope.variables[name] = substitute(body["default"], scope)
        value = scope.variables[name]
        if choices and value not in choices:
            raise LaunchError(
                f'Argument "{name}" provided value "{value}" is not valid. Valid options are: '
                f"{choices}"
            )

    def _let(self, body: dict[str, Any], scope: Scope) -> None:
        check_keys("let", body, set(), {"name", "value"})
        scope.variables[str(body["name"])] = substitute(body["value"], scope)

    def _set_env(self, body: dict[str, Any], scope: Scope) -> None:
        check_keys("set_env", body, set(), {"name", "value"})
        scope.environment[str(body["name"])] = substitute(body["value"], scope)

    def _unset_env(self, body: dict[str, Any], scope: Scope) -> None:
        check_keys("unset_env", body, set(), {"name"})
        scope.environment.pop(str(body["name"]), None)

    def _push_namespace(self, body: dict[str, Any], scope: Scope) -> None:
        check_keys("push_ros_namespace", body, set(), {"namespace"})
        scope.namespace = join(scope.namespace, substitute(body["namespace"], scope))

    def _set_remap(self, body: dict[str, Any], scope: Scope) -> None:
        check_keys("set_remap", body, set(), {"from", "to"})
        scope.remaps.append((substitute(body["from"], scope), substitute(body["to"], scope)))

    def _set_parameter(self, body: dict[str, Any], scope: Scope) -> None:
        check_keys("set_parameter", body, set(), {"name", "value"})
        scope.parameters += parameter_options([body], "", scope)

    def _log(self, body: dict[str, Any], scope: Scope) -> None:
        check_keys("log", body, set(), {"message"})
        self.plan.messages.append(substitute(body["message"], scope))

    # Files and groups.

    def _include(self, body: dict[str, Any], scope: Scope) -> None:
        check_keys("include", body, {"arg"}, {"file"})
        if self._only_arguments:
            with suppress(LaunchError):  # what its name depends on is not known yet
                path = Path(substitute(body["file"], Scope(Path())))
                if path.is_absolute():
                    self.read(path, scope)
            return
        for item in body.get("arg", []):
            scope.variables[substitute(item["name"], scope)] = substitute(item["value"], scope)
        # What the included file sets stays set, as in ROS 2, unless the include is in a group.
        inner = replace(scope, file=Path(substitute(body["file"], scope)).absolute())
        self.read(inner.file, inner)
        scope.namespace = inner.namespace

    def _group(self, body: Any, scope: Scope) -> None:
        if isinstance(body, list):
            body = {"children": body}
        if not isinstance(body, dict):
            raise LaunchError(f"'group' needs entities, not {body!r}")
        check_keys("group", body, {"scoped"}, {"children"})
        scoped = truth(substitute(body.get("scoped", "true"), scope))
        self._entities(body["children"], scope.inner() if scoped else scope)

    # Processes.

    def _node(self, body: dict[str, Any], scope: Scope) -> None:
        self.plan.processes.append(node_process(body, scope, len(self.plan.processes) + 1))

    def _executable(self, body: dict[str, Any], scope: Scope) -> None:
        self.plan.processes.append(executable_process(body, scope, len(self.plan.processes) + 1))


def read_launch_file(path: Path, arguments: dict[str, str]) -> LaunchPlan:
    """Reads a launch file with its arguments.

    Raises:
        LaunchError: the file makes no sense, or an argument is missing.
    """
    reader = LaunchReader()
    reader.read(path, Scope(path, dict(arguments)))
    return reader.plan


def read_arguments(path: Path) -> list[Argument]:
    """Arguments that a launch file and those that it includes declare."""
    reader = LaunchReader(only_arguments=True)
    reader.read(path, Scope(path))
    return list(reader.plan.arguments.values())
