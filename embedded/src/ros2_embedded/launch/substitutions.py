"""Substitutions in launch files: `$(var door)`, `$(find-pkg-share door_model)`, ..."""

from __future__ import annotations

import math
import os
import random
import shlex
import shutil
import socket
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ament_index_python.packages import (
    PackageNotFoundError,
    get_package_prefix,
    get_package_share_directory,
)

from ros2_embedded.launch.errors import LaunchError
from ros2_embedded.launch.substitution_parser import Call, Parts, parse


@dataclass
class Scope:
    """The scope of substitutions: the launch file, arguments, environment and namespace."""

    file: Path
    variables: dict[str, str] = field(default_factory=dict)
    environment: dict[str, str] = field(default_factory=lambda: dict(os.environ))
    namespace: str = ""
    remaps: list[tuple[str, str]] = field(default_factory=list)
    parameters: list[str] = field(default_factory=list)

    def inner(self) -> Scope:
        """A scope whose changes stay inside."""
        return Scope(
            self.file,
            dict(self.variables),
            dict(self.environment),
            self.namespace,
            list(self.remaps),
            list(self.parameters),
        )


def substitute(text: Any, scope: Scope) -> str:
    """Replaces every `$(...)`.

    Raises:
        LaunchError: an unknown substitution, or one that fails.
    """
    return _perform(parse(str(text)), scope)


def _perform(parts: Parts, scope: Scope) -> str:
    return "".join(part if isinstance(part, str) else _call(part, scope) for part in parts)


def _call(call: Call, scope: Scope) -> str:
    function = _FUNCTIONS.get(call.name)
    if function is None:
        raise LaunchError(f"Unknown substitution: {call.name}")
    arguments = [_perform(argument, scope) for argument in call.arguments]
    try:
        return function(scope, *arguments)
    except TypeError as error:
        raise LaunchError(f"{call.name} substitution: wrong number of arguments") from error
    except (PackageNotFoundError, ValueError, OSError) as error:
        raise LaunchError(str(error)) from error


def is_true(text: str) -> bool:
    """Whether a condition holds: true or false, 1 or 0.

    Raises:
        LaunchError: neither.
    """
    value = {"true": True, "1": True, "false": False, "0": False}.get(text.strip().lower())
    if value is None:
        raise LaunchError(
            f"invalid condition expression, expected one of ['true', '1', 'false', '0'] but got "
            f"'{text.strip().lower()}'"
        )
    return value


def truth(text: str) -> bool:
    """The value of a text that must be a bool; more words are allowed than in a condition.

    Raises:
        LaunchError: The text is not a bool.
    """
    words = {"true": True, "yes": True, "on": True, "1": True,
             "false": False, "no": False, "off": False, "0": False}  # fmt: skip
    if text.lower() not in words:
        raise LaunchError(f"Cannot convert value '{text}' to a bool")
    return words[text.lower()]


def _lower(value: bool) -> str:
    return str(value).lower()


def _eval(scope: Scope, expression: str, modules: str = "math") -> str:
    """The value of a Python expression, as in ROS 2; the names of `math` are defined."""
    names: dict[str, Any] = {}
    for module in (name.strip() for name in modules.split(",")):
        names[module] = __import__(module)
    if "math" in names:
        names.update(vars(math))
    try:
        return str(eval(expression, {}, names))
    except Exception as error:  # whatever the expression does
        raise LaunchError(str(error)) from error


def _var(scope: Scope, name: str, default: str | None = None) -> str:
    value = scope.variables.get(name, default)
    if value is None:
        raise LaunchError(f"launch configuration '{name}' does not exist")
    return value


def _env(scope: Scope, name: str, default: str | None = None) -> str:
    value = scope.environment.get(name, default)
    if value is None:
        raise LaunchError(f"environment variable '{name}' does not exist")
    return value


def _equals(left: str, right: str) -> bool:
    """Compares two texts; truth values and numbers are compared by value."""
    words = {"true": True, "1": True, "false": False, "0": False}
    if left.lower() in words and right.lower() in words:
        return words[left.lower()] == words[right.lower()]
    try:
        return math.isclose(float(left), float(right))
    except ValueError:
        return left == right


def _find_executable(scope: Scope, name: str) -> str:
    path = shutil.which(name)
    if path is None:
        raise LaunchError(f"executable '{name}' not found on the PATH")
    return path


def _command(scope: Scope, command: str, on_stderr: str = "fail") -> str:
    done = subprocess.run(shlex.split(command), capture_output=True, text=True)
    if done.returncode:
        raise LaunchError(
            f"executed command failed. Command: {command}\nCaptured stderr output: {done.stderr}"
        )
    if done.stderr and on_stderr == "fail":
        raise LaunchError(f"executed command showed stderr output. Command: {command}")
    return done.stdout + (done.stderr if on_stderr == "capture" else "")


def _anonymous(scope: Scope, name: str) -> str:
    """A unique name, the same for each call with this text."""
    number = random.randint(0, sys.maxsize)
    made = f"{name}_{socket.gethostname()}_{os.getpid()}_{number}"
    return scope.variables.setdefault(f"anon{name}", made.translate(str.maketrans(".-:", "___")))


_FUNCTIONS: dict[str, Callable[..., str]] = {
    "var": _var,
    "env": _env,
    "eval": _eval,
    "find-pkg-share": lambda scope, package: get_package_share_directory(package),
    "find-pkg-prefix": lambda scope, package: get_package_prefix(package),
    "find-exec": _find_executable,
    "exec-in-pkg": lambda scope, name, package: str(Path(sys.executable).with_name(name)),
    "dirname": lambda scope: str(scope.file.parent),
    "filename": lambda scope: str(scope.file),
    "file-content": lambda scope, path: Path(path).read_text(encoding="utf-8"),
    "command": _command,
    "anon": _anonymous,
    "equals": lambda scope, left, right: _lower(_equals(left, right)),
    "not-equals": lambda scope, left, right: _lower(not _equals(left, right)),
    "not": lambda scope, value: _lower(not truth(value)),
    "and": lambda scope, left, right: _lower(truth(left) and truth(right)),
    "or": lambda scope, left, right: _lower(truth(left) or truth(right)),
    "any": lambda scope, *values: _lower(any([truth(value) for value in values])),
    "all": lambda scope, *values: _lower(all([truth(value) for value in values])),
    "if": lambda scope, wanted, yes, no="": yes if truth(wanted) else no,
}
