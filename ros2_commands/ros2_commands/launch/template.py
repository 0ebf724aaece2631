"""The grammar of substitutions: `text $(name word 'words with $(name)') text`."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Union

from ros2_commands.errors import CommandError

_NAME = re.compile(r"[A-Za-z][\w-]*")


@dataclass(frozen=True)
class Call:
    """One `$(name arguments)`."""

    name: str
    arguments: tuple[Parts, ...]


Parts = tuple[Union[str, "Call"], ...]
"""Texts and calls in their order."""


def parse(text: str) -> Parts:
    """Parse a text; a backslash takes the meaning from the character after it.

    Raises:
        CommandError: A quote or a parenthesis is not closed, or a name is missing.
    """
    return _Parser(text).parts("")


class _Parser:
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
