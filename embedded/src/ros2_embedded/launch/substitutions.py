"""Substitutions in launch files: `$(var door)`, `$(find-pkg-share door_model)`, ..."""

from __future__ import annotations

import ast
import operator
import os
import shlex
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


@dataclass
class Scope:
    """What substitutions see: the file they stand in, arguments, environment, namespace."""

    file: Path
    variables: dict[str, str] = field(default_factory=dict)
    environment: dict[str, str] = field(default_factory=lambda: dict(os.environ))
    namespace: str = ""

    def inner(self) -> Scope:
        """A scope whose changes stay inside."""
        return Scope(self.file, dict(self.variables), dict(self.environment), self.namespace)


_OPERATORS: dict[type, Callable[..., Any]] = {
    ast.Eq: operator.eq, ast.NotEq: operator.ne, ast.Lt: operator.lt, ast.LtE: operator.le,
    ast.Gt: operator.gt, ast.GtE: operator.ge, ast.In: lambda a, b: a in b,
    ast.NotIn: lambda a, b: a not in b, ast.Add: operator.add, ast.Sub: operator.sub,
    ast.Mult: operator.mul, ast.Div: operator.truediv, ast.Not: operator.not_,
    ast.USub: operator.neg,
}  # fmt: skip


def _evaluate(node: ast.AST, text: str) -> Any:
    """Value of an expression of constants, comparisons, arithmetic and `and`, `or`, `not`, `if`."""
    match node:
        case ast.Expression():
            return _evaluate(node.body, text)
        case ast.Constant():
            return node.value
        case ast.Name(id="true" | "false"):
            return node.id == "true"
        case ast.List() | ast.Tuple():
            return [_evaluate(item, text) for item in node.elts]
        case ast.UnaryOp() if type(node.op) in _OPERATORS:
            return _OPERATORS[type(node.op)](_evaluate(node.operand, text))
        case ast.BinOp() if type(node.op) in _OPERATORS:
            return _OPERATORS[type(node.op)](
                _evaluate(node.left, text), _evaluate(node.right, text)
            )
        case ast.BoolOp():
            values = [_evaluate(value, text) for value in node.values]
            return all(values) if isinstance(node.op, ast.And) else any(values)
        case ast.Compare() if len(node.ops) == 1 and type(node.ops[0]) in _OPERATORS:
            left, right = _evaluate(node.left, text), _evaluate(node.comparators[0], text)
            return _OPERATORS[type(node.ops[0])](left, right)
        case ast.IfExp():
            chosen = node.body if _evaluate(node.test, text) else node.orelse
            return _evaluate(chosen, text)
    raise LaunchError(
        f"$(eval {text}): only constants, comparisons and arithmetic are supported here"
    )


def _eval(scope: Scope, text: str) -> str:
    quoted = len(text) > 1 and text[0] == text[-1] and text[0] in "'\""
    expression = text[1:-1] if quoted and text[0] not in text[1:-1] else text
    try:
        return str(_evaluate(ast.parse(expression, mode="eval"), expression))
    except (SyntaxError, TypeError, ZeroDivisionError) as error:
        raise LaunchError(f"$(eval {text}): {error}") from error


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


def _find(function: Callable[[str], str]) -> Callable[[Scope, str], str]:
    def find(scope: Scope, package: str) -> str:
        try:
            return function(package)
        except (PackageNotFoundError, ValueError) as error:
            raise LaunchError(str(error)) from error

    return find


_FUNCTIONS: dict[str, Callable[..., str]] = {
    "var": _var,
    "env": _env,
    "optenv": lambda scope, name, default="": scope.environment.get(name, default),
    "find-pkg-share": _find(get_package_share_directory),
    "find-pkg-prefix": _find(get_package_prefix),
    "dirname": lambda scope: str(scope.file.parent),
    "filename": lambda scope: str(scope.file),
    "equals": lambda scope, left, right: str(left == right),
    "not": lambda scope, value: str(not is_true(value)),
    "and": lambda scope, left, right: str(is_true(left) and is_true(right)),
    "or": lambda scope, left, right: str(is_true(left) or is_true(right)),
}


def is_true(text: Any) -> bool:
    """Whether a condition holds: true or false, 1 or 0.

    Raises:
        LaunchError: neither.
    """
    value = {"true": True, "1": True, "false": False, "0": False}.get(str(text).strip().lower())
    if value is None:
        raise LaunchError(f"'{text}' is no condition: true, false, 1 or 0 expected")
    return value


def substitute(text: Any, scope: Scope) -> str:
    """Replaces every `$(...)`, the innermost first.

    Raises:
        LaunchError: an unknown substitution, or one that fails.
    """
    value = str(text)
    while "$(" in value:
        start = value.rindex("$(")
        end = value.find(")", start)
        if value[start:].startswith("$(eval"):
            end = _closing(value, start)
        if end < 0:
            raise LaunchError(f"'{text}': a $( is not closed")
        value = value[:start] + _call(value[start + 2 : end], scope) + value[end + 1 :]
    return value


def _closing(value: str, start: int) -> int:
    """Where the parenthesis that opens at `start` closes, for expressions with their own."""
    depth = 0
    for i in range(start + 1, len(value)):
        depth += {"(": 1, ")": -1}.get(value[i], 0)
        if depth == 0:
            return i
    return -1


def _call(inside: str, scope: Scope) -> str:
    name, _, rest = inside.strip().partition(" ")
    if name == "eval":
        return _eval(scope, rest.strip())
    function = _FUNCTIONS.get(name)
    if function is None:
        known = ", ".join(sorted([*_FUNCTIONS, "eval"]))
        raise LaunchError(f"unknown substitution $({inside}); there are: {known}")
    try:
        return function(scope, *shlex.split(rest))
    except (TypeError, ValueError) as error:
        raise LaunchError(f"$({inside}): wrong arguments") from error
