"""How YAML files are read and written: the core schema of YAML 1.2, without doubled keys.

PyYAML follows YAML 1.1, for which 6e-2 is a text, 12:30 is 750, 047 is 39 and "no" is false. In a
file of a robot or a door such a number would be plausible and wrong.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import yaml

from door_impact_common.errors import InputError
from door_impact_common.files import read_file, shown

LARGEST = 1_000_000  # size of a YAML file that is read at most [bytes]
_TAG = "tag:yaml.org,2002:"
_ODD = "!odd"  # a number in YAML 1.1 that is another one, or none, in YAML 1.2
_SCALARS = {  # YAML 1.2.2, section 10.3.2; the first that matches counts
    _TAG + "merge": r"<<",
    _TAG + "null": r"~|null|Null|NULL|",
    _TAG + "bool": r"true|True|TRUE|false|False|FALSE",
    _TAG + "int": r"[-+]?(0|[1-9][0-9]*)",
    _TAG + "float": r"[-+]?(0|[1-9][0-9]*|(?=\.[0-9]))(\.[0-9]*)?([eE][-+]?[0-9]+)?"
                    r"|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)",
    _ODD: r"[-+]?0[0-9_]+(\.[0-9_]*)?([eE][-+]?[0-9]+)?|[-+]?[0-9][0-9.]*_[0-9_.]*"
          r"|[-+]?[0-9]+(:[0-5]?[0-9])+(\.[0-9]*)?|[-+]?0[xXoObB][0-9a-fA-F_]+",
}


class _Loader(yaml.SafeLoader):
    """Reads YAML 1.2, and refuses doubled keys and numbers in other spellings."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        known = []
        for key, _ in node.value:
            if key.value in known and key.tag != _TAG + "merge":
                raise yaml.constructor.ConstructorError(
                    problem=f"the key {shown(str(key.value))!r} is there twice",
                    problem_mark=key.start_mark)
            known.append(key.value)
        return super().construct_mapping(node, deep)


class _Dumper(yaml.SafeDumper):
    """Quotes each text that would be read as something else."""


def _odd(_: _Loader, node: yaml.ScalarNode) -> None:
    raise yaml.constructor.ConstructorError(
        problem=f"{shown(node.value)} is no decimal number; write one, or a text in quotes",
        problem_mark=node.start_mark)


for _kind in (_Loader, _Dumper):
    _kind.yaml_implicit_resolvers = {}
    for _tag, _pattern in _SCALARS.items():
        _kind.add_implicit_resolver(_tag, re.compile(rf"(?:{_pattern})\Z"), None)
_Loader.add_constructor(_ODD, _odd)


def read_yaml(path: str | Path) -> Any:
    """Read a YAML file that a user, a parameter or a message names.

    Args:
        path: The file.

    Returns:
        Its content; None if it is empty.

    Raises:
        InputError: The file cannot be read or is no YAML, a key is doubled, or a number is spelled
            so that YAML 1.1 and 1.2 differ. The message names the line.
    """
    try:
        return yaml.load(read_file(path, largest=LARGEST).decode("utf-8"), _Loader)
    except UnicodeDecodeError as error:
        raise InputError(shown(path), "is not a text in UTF-8") from error
    except RecursionError as error:
        raise InputError(shown(path), "is nested too deeply") from error
    except yaml.constructor.ConstructorError as error:
        raise InputError(shown(path), f"{_place(error)}{error.problem}") from error
    except (yaml.YAMLError, ValueError, TypeError, AttributeError, OverflowError) as error:
        raise InputError(shown(path), f"{_place(error)}is no valid YAML") from error


def _place(error: Exception) -> str:
    mark = getattr(error, "problem_mark", None)
    return f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""


def yaml_text(document: Any) -> str:
    """Return a document of mappings, lists and scalars as YAML that `read_yaml` reads alike."""
    return yaml.dump(document, Dumper=_Dumper, sort_keys=False, allow_unicode=True)
