"""Read launch files in YAML into a list of processes."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import yaml

from ros2_commands.errors import CommandError
from ros2_commands.launch.nodes import (
    CONDITIONS,
    Process,
    check_keys,
    node_process,
    push_namespace,
    set_remap,
)
from ros2_commands.launch.substitutions import Scope, describe, is_true, substitute


@dataclass(frozen=True)
class Argument:
    """An argument of a launch file; `default` and `description` as they are shown."""

    name: str
    default: str | None
    description: str


def read_processes(path: Path, arguments: dict[str, str]) -> list[Process]:
    """Read a launch file.

    Args:
        path: The file.
        arguments: Values for what it declares with `arg`.

    Returns:
        What it starts, and the files that it includes.

    Raises:
        CommandError: A file is missing or makes no sense, or an argument is missing.
    """
    reader = _Reader(only_arguments=False)
    reader.read(Scope(path, dict(arguments)))
    return reader.processes


def read_arguments(path: Path) -> list[Argument]:
    """Return the arguments that a launch file declares, and those of the files that it includes.

    Raises:
        CommandError: A file is missing or makes no sense.
    """
    reader = _Reader(only_arguments=True)
    reader.read(Scope(path))
    return list(reader.arguments.values())


class _Reader:
    """Reads launch files; with `only_arguments`, what has no value yet is no error."""

    def __init__(self, only_arguments: bool) -> None:
        self.processes: list[Process] = []
        self.arguments: dict[str, Argument] = {}
        self._only_arguments = only_arguments
        self._handlers: dict[str, Callable[[Any, Scope], None]] = {
            "arg": self._arg,
            "let": self._let,
            "node": self._node,
            "include": self._include,
            "group": self._group,
            "push_ros_namespace": push_namespace,
            "set_remap": set_remap,
        }

    def read(self, scope: Scope) -> None:
        """Read the file of a scope."""
        path = scope.file
        try:
            tree = yaml.safe_load(path.read_text(encoding="utf-8"))
        except (OSError, yaml.YAMLError, UnicodeDecodeError) as error:
            raise CommandError(f"{path}: launch files in YAML only: {error}") from error
        if not isinstance(tree, dict) or not isinstance(tree.get("launch"), list):
            raise CommandError(f"{path}: Expected 'launch' as root tag of a file in YAML")
        try:
            self._entities(tree["launch"], scope)
        except CommandError as error:
            text = str(error)
            raise CommandError(text if ".yaml: " in text else f"{path}: {text}") from error

    def _entities(self, entities: list[Any], scope: Scope) -> None:
        for entity in entities:
            if not isinstance(entity, dict) or len(entity) != 1:
                raise CommandError(f"{entity!r} is no launch entity")
            ((kind, body),) = entity.items()
            if kind not in self._handlers:
                raise CommandError(f"Unrecognized entity of the type: {kind}")
            if not isinstance(body, list if kind == "group" else dict):
                raise CommandError(f"'{kind}' cannot be {body!r}")
            if self._wanted(kind, body, scope):
                self._handlers[kind](body, scope)

    def _wanted(self, kind: str, body: Any, scope: Scope) -> bool:
        if self._only_arguments:
            return kind in ("arg", "include", "group")
        given = [key for key in CONDITIONS if key in body]
        return all(is_true(substitute(body[key], scope)) == (key == "if") for key in given)

    def _arg(self, body: dict[str, Any], scope: Scope) -> None:
        check_keys("arg", body, {"default", "description", "choice"}, {"name"})
        name = str(body["name"])
        choices = [str(choice["value"]) for choice in body.get("choice", [])]
        description = str(body.get("description", "no description given"))
        if choices:
            description = f"{description.rstrip('.')}. Valid choices are: {choices}"
        shown = describe(body["default"]) if "default" in body else None
        self.arguments.setdefault(name, Argument(name, shown, description))
        if not self._only_arguments:
            self._set(name, body, choices, scope)

    def _set(self, name: str, body: dict[str, Any], choices: list[str], scope: Scope) -> None:
        if name not in scope.variables:
            if "default" not in body:
                raise CommandError(f"missing required argument '{name}'")
            scope.variables[name] = substitute(body["default"], scope)
        if choices and scope.variables[name] not in choices:
            raise CommandError(f'Argument "{name}" provided value "{scope.variables[name]}" is '
                               f"not valid. Valid options are: {choices}")  # fmt: skip

    def _let(self, body: dict[str, Any], scope: Scope) -> None:
        check_keys("let", body, set(), {"name", "value"})
        scope.variables[str(body["name"])] = substitute(body["value"], scope)

    def _include(self, body: dict[str, Any], scope: Scope) -> None:
        check_keys("include", body, {"arg"}, {"file"})
        if self._only_arguments:
            with suppress(CommandError):  # what the file's name depends on has no value yet
                self.read(Scope(Path(substitute(body["file"], scope))))
            return
        for item in body.get("arg", []):
            scope.variables[str(item["name"])] = substitute(item["value"], scope)
        # As in ROS 2, what the included file sets stays set.
        self.read(replace(scope, file=Path(substitute(body["file"], scope))))

    def _group(self, entities: list[Any], scope: Scope) -> None:
        self._entities(entities, scope.inner())

    def _node(self, body: dict[str, Any], scope: Scope) -> None:
        self.processes.append(node_process(body, scope, len(self.processes) + 1))
