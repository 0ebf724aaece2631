"""Parse and replace substitutions in launch files, as `$(find-pkg-share door_model)`.

Their grammar is: `text $(name word 'words with $(name)') text`.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Union

from ros2_commands.errors import CommandError
from ros2_commands.packages import share

_NAME = re.compile(r"[A-Za-z][\w-]*")
_TRUTHS = {"true": True, "1": True, "false": False, "0": False}


@dataclass(frozen=True)
class Call:
    """One `$(name arguments)`."""

    name: str
    arguments: tuple[Parts, ...]


Parts = tuple[Union[str, "Call"], ...]
"""Texts and calls in their order."""


@dataclass
class Scope:
    """What entities depend on: the launch file, its variables and the remappings of all nodes."""

    file: Path
    variables: dict[str, str] = field(default_factory=dict)
    remaps: list[str] = field(default_factory=list)

    def inner(self) -> Scope:
        """Return a scope whose changes stay inside."""
        return replace(self, variables=dict(self.variables), remaps=list(self.remaps))


def substitute(text: Any, scope: Scope) -> str:
    """Replace every `$(...)` in a text.

    Raises:
        CommandError: An unknown substitution, or one that fails.
    """
    return _perform(_Parser(str(text)).parts(""), scope)


def describe(text: Any) -> str:
    """Return a text with substitutions as `ros2 launch --show-args` shows it."""
    return _described(_Parser(str(text)).parts(""))


def is_true(text: str) -> bool:
    """Return whether a condition holds.

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


class _Parser:
    """Parses a text; a backslash takes the meaning from the character after it.

    Its methods raise `CommandError` where a quote or a parenthesis is not closed, or a name is
    missing.
    """

    def __init__(self, text: str) -> None:
        self._text, self._at = text, 0

    def _next(self) -> str:
        return self._text[self._at : self._at + 1]

    def _take(self, wanted: str) -> None:
        if not wanted or self._next() != wanted:
            raise CommandError(f"'{self._text}' cannot be parsed at character {self._at + 1}")
        self._at += 1

    def parts(self, ends: str) -> Parts:
        """Parse up to one of the characters in `ends`, or up to the end."""
        parts: list[str | Call] = []
        text = ""
        while (character := self._next()) and character not in ends:
            if self._text.startswith("$(", self._at):
                parts += [text, self._call()]
                text = ""
                continue
            if character == "\\" and self._at + 1 < len(self._text):
                self._at += 1
            text += self._next()
            self._at += 1
        return tuple(part for part in (*parts, text) if part != "")

    def _call(self) -> Call:
        self._at += 2
        name = _NAME.match(self._text, self._at)
        self._at = name.end() if name else self._at
        arguments = []
        while name and self._next() == " ":
            self._at += 1
            arguments.append(self._argument())
        self._take(")" if name else "")
        return Call(name[0] if name else "", tuple(arguments))

    def _argument(self) -> Parts:
        quote = self._next()
        if quote not in ("'", '"'):
            return self.parts(" )")
        self._at += 1
        parts = self.parts(quote)
        self._take(quote)
        return parts
