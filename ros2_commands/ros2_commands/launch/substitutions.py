"""Substitutions in launch files: `$(var door)`, `$(find-pkg-share door_model)`, ..."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ros2_commands.errors import CommandError
from ros2_commands.launch.template import Call, Parts, parse
from ros2_commands.packages import share

_TRUTHS = {"true": True, "1": True, "false": False, "0": False}


@dataclass
class Scope:
    """What substitutions depend on: the launch file and its variables."""

    file: Path
    variables: dict[str, str] = field(default_factory=dict)

    def inner(self) -> Scope:
        """Give a scope whose changes stay inside."""
        return replace(self, variables=dict(self.variables))


def substitute(text: Any, scope: Scope) -> str:
    """Replace every `$(...)` in a text.

    Raises:
        CommandError: An unknown substitution, or one that fails.
    """
    return _perform(parse(str(text)), scope)


def describe(text: Any) -> str:
    """Describe a text with substitutions as `ros2 launch --show-args` does."""
    return _described(parse(str(text)))


def is_true(text: str) -> bool:
    """Tell whether a condition holds.

    Raises:
        CommandError: The text is none of true, 1, false and 0.
    """
    value = _TRUTHS.get(text.strip().lower())
    if value is None:
        raise CommandError("invalid condition expression, expected one of "
                           f"['true', '1', 'false', '0'] but got '{text}'")  # fmt: skip
    return value


def _perform(parts: Parts, scope: Scope) -> str:
    return "".join(part if isinstance(part, str) else _result(part, scope) for part in parts)


def _result(call: Call, scope: Scope) -> str:
    _, arity, function = _known(call)
    if len(call.arguments) != arity:
        raise CommandError(f"{call.name} substitution: {arity} argument(s) expected")
    return function(scope, *(_perform(argument, scope) for argument in call.arguments))


def _known(call: Call) -> tuple[str, int, Callable[..., str]]:
    if call.name not in _SUBSTITUTIONS:
        raise CommandError(f"Unknown substitution: {call.name}")
    return _SUBSTITUTIONS[call.name]


def _described(parts: Parts) -> str:
    texts = (f"'{part}'" if isinstance(part, str) else _call_described(part) for part in parts)
    return " + ".join(texts) or "''"


def _call_described(call: Call) -> str:
    return _known(call)[0].format(" ".join(map(_described, call.arguments)))


def _var(scope: Scope, name: str) -> str:
    if name not in scope.variables:
        raise CommandError(f"launch configuration '{name}' does not exist")
    return scope.variables[name]


def _env(scope: Scope, name: str) -> str:
    if name not in os.environ:
        raise CommandError(f"environment variable '{name}' does not exist")
    return os.environ[name]


def _eval(scope: Scope, expression: str) -> str:
    try:
        return str(eval(expression, {}, {"math": math, **vars(math)}))
    except Exception as error:  # whatever the expression does
        raise CommandError(f"$(eval {expression}): {error}") from error


def _equals(scope: Scope, left: str, right: str) -> str:
    """Compare two texts; truth values and numbers are compared by value."""
    if left.lower() in _TRUTHS and right.lower() in _TRUTHS:
        return _lower(_TRUTHS[left.lower()] == _TRUTHS[right.lower()])
    try:
        return _lower(math.isclose(float(left), float(right)))
    except ValueError:
        return _lower(left == right)


def _lower(value: bool) -> str:
    return str(value).lower()


_SUBSTITUTIONS: dict[str, tuple[str, int, Callable[..., str]]] = {
    "var": ("LaunchConfig({})", 1, _var),
    "env": ("EnvVar({})", 1, _env),
    "eval": ("PythonExpr({}, ['math'])", 1, _eval),
    "find-pkg-share": ("FindPackageShare(pkg={})", 1, lambda _, package: str(share(package))),
    "dirname": ("ThisLaunchFileDir()", 0, lambda scope: str(scope.file.parent)),
    "equals": ("EqualsSubstitution({})", 2, _equals),
    "not": ("NotSubstitution({})", 1, lambda _, value: _lower(not is_true(value))),
}
"""Name: how it is described, number of arguments, what it gives."""
