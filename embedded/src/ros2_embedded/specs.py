"""Interface definitions as data, and the parser of `.msg`, `.srv` and `.action` files."""

from __future__ import annotations

import re
from codecs import decode
from dataclasses import dataclass, field
from typing import Any

PRIMITIVES = frozenset(
    [
        "bool",
        "byte",
        "char",
        "float32",
        "float64",
        "int8",
        "uint8",
        "int16",
        "uint16",
        "int32",
        "uint32",
        "int64",
        "uint64",
        "string",
    ]
)
TYPECODES = {
    "int8": "b", "uint8": "B", "char": "B", "int16": "h", "uint16": "H", "int32": "i",
    "uint32": "I", "int64": "q", "uint64": "Q", "float32": "f", "float64": "d",
}  # fmt: skip
"""Type codes of the numbers whose sequences are an array.array or a numpy array."""
INTEGER_BITS = {f"{sign}int{bits}": bits for sign in ("", "u") for bits in (8, 16, 32, 64)}
DUMMY_FIELD = "structure_needs_at_least_one_member"
"""IDL has no empty struct, so ROS 2 adds this uint8 field to a message without fields."""

_FIELD = re.compile(
    r"(?P<type>[A-Za-z][\w/]*)(?P<bound><=\d+)?(?P<array>\[(?:<=)?\d*\])?"
    r"\s+(?P<name>\w+)\s*(?P<rest>.*)"
)
_ITEM = r"""(?:"(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*'|[^,'"\s][^,]*)"""
"""An element of an array, in quotes or not."""
_ARRAY = re.compile(rf"\[\s*(?:{_ITEM}\s*(?:,\s*{_ITEM}\s*)*)?\]")
_ESCAPE = re.compile(r"\\(?:[ntvbrfa\\'\"]|[0-7]{1,3}|x[0-9a-fA-F]{1,2})")
"""An escape sequence in a string."""


class InterfaceError(Exception):
    """The definition of an interface is missing or cannot be read."""


@dataclass(frozen=True)
class FieldType:
    """Type of a field: a primitive or `pkg/msg/Name`, alone or as an array or a sequence.

    Attributes:
        base: Primitive type of ROS (`float64`), or full name of a message.
        container: Empty, `array` (fixed length) or `sequence`.
        size: Length of an array, or bound of a sequence; 0 means unbounded.
        string_bound: Greatest length of a string; 0 means unbounded.
    """

    base: str
    container: str = ""
    size: int = 0
    string_bound: int = 0

    @property
    def primitive(self) -> bool:
        """Whether the elements are primitives."""
        return self.base in PRIMITIVES

    def __str__(self) -> str:
        """The type as it is written in a `.msg` file."""
        base = self.base.replace("/msg/", "/")
        base += f"<={self.string_bound}" if self.string_bound else ""
        if self.container == "array":
            return f"{base}[{self.size}]"
        if self.container == "sequence":
            return f"{base}[<={self.size}]" if self.size else f"{base}[]"
        return base


@dataclass(frozen=True)
class Field:
    """A field of a message; `default` is None if the definition has no default value."""

    name: str
    type: FieldType
    default: Any = None


@dataclass(frozen=True)
class Constant:
    """A constant of a message."""

    name: str
    type: str
    value: Any


@dataclass(frozen=True)
class MessageSpec:
    """A message: `name` is full, `text` the source where there is one."""

    name: str
    fields: tuple[Field, ...]
    constants: tuple[Constant, ...] = ()
    text: str = field(default="", compare=False)

    @property
    def package(self) -> str:
        """Package of the message."""
        return self.name.split("/")[0]

    @property
    def wire_fields(self) -> tuple[Field, ...]:
        """The fields in IDL; there is at least one."""
        return self.fields or (Field(DUMMY_FIELD, FieldType("uint8")),)


def _unquoted(text: str, kind: FieldType, where: str) -> str:
    """Removes the quotes around a string, and the backslash before each such quote within it."""
    quote = text[:1]
    if len(text) > 1 and quote in "'\"" and text.endswith(quote):
        text = text[1:-1]
        if re.search(rf"(?<!\\){quote}", text):
            raise InterfaceError(f"{where}: a quote in the string {text} lacks its backslash")
        text = text.replace("\\" + quote, quote)
    if kind.string_bound and len(text) > kind.string_bound:
        raise InterfaceError(f"{where}: '{text}' has more than {kind.string_bound} characters")
    return text


def _items(text: str, kind: FieldType, where: str) -> list[str]:
    """The elements of an array `[a, "b, c"]`, as they are written."""
    if not _ARRAY.fullmatch(text):
        raise InterfaceError(f"{where}: cannot read the array '{text}'")
    items = [item.strip() for item in re.findall(_ITEM, text[1:-1])]
    if len(items) > kind.size > 0 or (kind.container == "array" and len(items) < kind.size):
        raise InterfaceError(f"{where}: {len(items)} values for {kind}")
    return items


def _value(text: str, kind: FieldType, where: str) -> Any:
    """Reads a default value or a constant."""
    if kind.container:
        items = _items(text, kind, where)
        if kind.base == "string":
            return [_unquoted(item, kind, where) for item in items]
        return [_value(item, FieldType(kind.base), where) for item in items]
    try:
        if kind.base == "string":
            plain = _unquoted(text, kind, where)
            return _ESCAPE.sub(lambda match: decode(match[0], "unicode-escape"), plain)
        if kind.base == "bool":
            return {"true": True, "1": True, "false": False, "0": False}[text.lower()]
        if kind.base.startswith("float"):
            return float(text)
        number = int(text, 10 if text.lstrip("+-").isdigit() else 0)
        return bytes([number]) if kind.base == "byte" else number
    except (KeyError, ValueError) as error:
        raise InterfaceError(f"{where}: '{text}' is no {kind.base}") from error


def _field_type(match: re.Match[str], package: str) -> FieldType:
    base = match["type"]
    if base not in PRIMITIVES:
        parts = base.split("/")
        if len(parts) == 1:
            owner = "std_msgs" if base == "Header" else package
            base = f"{owner}/msg/{base}"
        else:
            base = f"{parts[0]}/msg/{parts[-1]}"
    array = (match["array"] or "").strip("[]")
    container = "" if match["array"] is None else "sequence"
    if array and not array.startswith("<="):
        container = "array"
    size = int(array.removeprefix("<=") or 0)
    return FieldType(base, container, size, int((match["bound"] or "<=0")[2:]))


def parse_message(name: str, text: str) -> MessageSpec:
    """Parses one message.

    Args:
        name: Full name, `pkg/msg/Name`.
        text: Content of the `.msg` file.

    Raises:
        InterfaceError: a line that is neither a field nor a constant.
    """
    fields: list[Field] = []
    constants: list[Constant] = []
    for number, raw in enumerate(text.splitlines(), 1):
        line = raw.partition("#")[0].strip()  # also within quotes, as in ROS 2
        if not line:
            continue
        where = f"{name}, line {number}"
        match = _FIELD.fullmatch(line)
        if match is None:
            raise InterfaceError(f"{where}: cannot read '{line}'")
        kind, rest = _field_type(match, name.split("/")[0]), match["rest"]
        if rest.startswith("="):
            value = _value(rest[1:].strip(), kind, where)
            constants.append(Constant(match["name"], kind.base, value))
        else:
            default = _value(rest, kind, where) if rest else None
            fields.append(Field(match["name"], kind, default))
    return MessageSpec(name, tuple(fields), tuple(constants), text)


def split_sections(name: str, text: str, count: int) -> list[str]:
    """Splits a service (2 sections) or an action (3) at its `---` lines."""
    sections = [""]
    for line in text.splitlines(keepends=True):
        if line.strip() == "---":
            sections.append("")
        else:
            sections[-1] += line
    if len(sections) != count:
        raise InterfaceError(f"{name}: {len(sections)} sections, {count} expected")
    return sections
