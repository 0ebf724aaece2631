"""How YAML files that users write are read."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml

from door_impact_common.errors import InputError
from door_impact_common.files import read_file, shown

LARGEST = 1_000_000  # size of a YAML file that is read at most [bytes]
MOST_NODES = 100_000  # number of scalars, lists and mappings, each alias counted with its content
DEEPEST = 50  # number of lists and mappings inside each other


class _LimitError(yaml.YAMLError):
    """A document has too many nodes, or they are nested too deeply."""


class _Loader(yaml.SafeLoader):
    """A safe loader that stops early in a document that would exhaust memory or stack.

    A few lines with aliases can stand for billions of nodes, and a document nested some hundred
    times exceeds Python's recursion limit in whatever walks through it.
    """

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._nodes = 0  # number of nodes until now
        self._depth = 0  # depth of the current node
        self._deepest = 0  # largest depth within the node that is being composed
        self._known: dict[yaml.Node, tuple[int, int]] = {}  # number and height of a node's content

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        alias = self.check_event(yaml.AliasEvent)
        nodes, deepest = self._nodes, self._deepest
        self._depth += 1
        self._deepest = self._depth
        self._count(1)
        node = super().compose_node(parent, index)
        if node is not None and not alias:
            self._known[node] = self._nodes - nodes, self._deepest - self._depth
        elif node in self._known:
            number, height = self._known[node]
            self._deepest = self._depth + height
            self._count(number)
        else:
            raise _LimitError("contains itself")
        self._depth -= 1
        self._deepest = max(self._deepest, deepest)
        return node

    def _count(self, number: int) -> None:
        self._nodes += number
        if self._nodes > MOST_NODES:
            raise _LimitError(f"has more than {MOST_NODES} entries")
        if self._deepest > DEEPEST:
            raise _LimitError(f"is nested more than {DEEPEST} times")


def read_yaml(path: str | Path, folders: Sequence[Path] | None = None) -> Any:
    """Read a YAML file that a user, a parameter or a message names.

    Args:
        path: The file.
        folders: As for `read_file`.

    Returns:
        Its content; None if it is empty.

    Raises:
        InputError: The file cannot be read or is no YAML, or its content is too much or nested too
            deeply. The message names the line, and contains nothing of the file.
    """
    try:
        return yaml.load(read_file(path, folders, largest=LARGEST).decode("utf-8"), _Loader)
    except UnicodeDecodeError as error:
        raise InputError(shown(path), "is not a text in UTF-8") from error
    except _LimitError as error:
        raise InputError(shown(path), str(error)) from error
    except (yaml.YAMLError, ValueError, TypeError, AttributeError, OverflowError) as error:
        mark = getattr(error, "problem_mark", None)
        place = f", line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        raise InputError(shown(path), f"is no valid YAML{place}") from error
