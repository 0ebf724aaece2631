"""The grammar of substitutions: `text $(name argument 'argument with $(name)') text`."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Union

from ros2_embedded.launch.errors import LaunchError

_NAME = re.compile(r"[A-Za-z][\w-]*")


@dataclass(frozen=True)
class Call:
    """One `$(...)`."""

    name: str
    arguments: tuple[Parts, ...]


Parts = tuple[Union[str, "Call"], ...]
"""Texts and calls in their order."""


def parse(text: str) -> Parts:
    """Parses a text; a backslash escapes the character after it.

    Raises:
        LaunchError: A quote or a parenthesis is not closed, or is not allowed in its place.
    """
    return _Parser(text).template("") or ("",)


def describe(parts: Parts) -> str:
    """Describes a text as `ros2 launch --show-args` does."""
    return " + ".join(
        f"'{part}'" if isinstance(part, str) else _described(part) for part in parts
    )  # fmt: skip


def _described(call: Call) -> str:
    texts = [describe(argument) for argument in call.arguments]
    first = texts[0] if texts else ""
    forms = {
        "var": f"LaunchConfig({first})",
        "env": f"EnvVar({first})",
        "eval": f"PythonExpr({first}, ['math'])",
        "find-pkg-share": f"FindPackageShare(pkg={first})",
        "find-pkg-prefix": f"FindPackagePrefix(pkg={first})",
        "find-exec": f"FindExec({first})",
        "dirname": "ThisLaunchFileDir()",
        "filename": "ThisLaunchFile()",
        "command": f"Command({first})",
        "anon": f"AnonName({first})",
    }
    name = f"{call.name.title().replace('-', '')}Substitution"
    return forms.get(call.name, f"{name}({' '.join(texts)})")


class _Parser:
    def __init__(self, text: str) -> None:
        self._text, self._at = text, 0

    def _error(self) -> LaunchError:
        return LaunchError(f"'{self._text}' cannot be parsed at character {self._at + 1}")

    def _next(self) -> str:
        return self._text[self._at : self._at + 1]

    def _escaped(self) -> str:
        """The next character, and what a backslash before it hides."""
        if self._next() == "\\" and self._at + 1 < len(self._text):
            self._at += 1
        self._at += 1
        return self._text[self._at - 1]

    def template(self, quote: str) -> Parts:
        """Parses up to the closing quote, or up to the end if no quote is open."""
        parts: list[str | Call] = []
        while self._at < len(self._text):
            if self._text.startswith("$(", self._at):
                parts.append(self._call(quote))
            elif quote and self._next() == quote:
                self._at += 1
                return tuple(parts)
            else:
                _append(parts, self._escaped())
        if quote:
            raise self._error()
        return tuple(parts)

    def _call(self, quote: str) -> Call:
        name = _NAME.match(self._text, self._at + 2)
        if name is None:
            raise self._error()
        self._at = name.end()
        arguments = []
        while self._next() == " ":
            self._at += 1
            arguments.append(self._argument(quote))
        if self._next() != ")":
            raise self._error()
        self._at += 1
        return Call(name[0], tuple(arguments))

    def _argument(self, quote: str) -> Parts:
        """A word, or outside of quotes a quoted text."""
        if not quote and self._next() in ("'", '"'):
            self._at += 1
            return self.template(self._text[self._at - 1]) or ("",)
        parts: list[str | Call] = []
        while self._next() not in ("", " ", ")"):
            if self._text.startswith("$(", self._at):
                parts.append(self._call(quote))
            elif self._next() in ("(", quote or "'", quote or '"'):
                raise self._error()
            else:
                _append(parts, self._escaped())
        if not parts:
            raise self._error()
        return tuple(parts)


def _append(parts: list[str | Call], character: str) -> None:
    if parts and isinstance(parts[-1], str):
        parts[-1] += character
    else:
        parts.append(character)
