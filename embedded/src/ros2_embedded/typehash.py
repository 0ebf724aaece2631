"""RIHS01, the hash by which ROS 2 nodes compare types (REP-2011, REP-2016).

The description of a type and of every type that it refers to is written as JSON in a fixed form and
hashed with SHA-256. Defaults, constants and comments are left out.
"""

from __future__ import annotations

import hashlib
import json
from functools import cache
from typing import Any

from ros2_embedded.catalogue import message_spec
from ros2_embedded.specs import FieldType

# type_description_interfaces/msg/FieldType: the scalar's number; a container adds to it.
_SCALARS = {
    "int8": 2, "uint8": 3, "int16": 4, "uint16": 5, "int32": 6, "uint32": 7, "int64": 8,
    "uint64": 9, "float32": 10, "float64": 11, "char": 3, "bool": 15, "byte": 16, "string": 17,
}  # fmt: skip
_NESTED, _BOUNDED_STRING = 1, 21
_ARRAY, _BOUNDED_SEQUENCE, _SEQUENCE = 48, 96, 144


def _type_id(kind: FieldType) -> int:
    number = _SCALARS.get(kind.base, _NESTED)
    if kind.string_bound:
        number = _BOUNDED_STRING
    if kind.container == "array":
        return number + _ARRAY
    if kind.container == "sequence":
        return number + (_BOUNDED_SEQUENCE if kind.size else _SEQUENCE)
    return number


def _describe(name: str, described: dict[str, dict[str, Any]]) -> None:
    """Adds the description of `name` and of what it refers to."""
    if name in described:
        return
    fields = message_spec(name).wire_fields
    described[name] = {
        "type_name": name,
        "fields": [
            {
                "name": field.name,
                "type": {
                    "type_id": _type_id(field.type),
                    "capacity": field.type.size,
                    "string_capacity": field.type.string_bound,
                    "nested_type_name": "" if field.type.primitive else field.type.base,
                },
            }
            for field in fields
        ],
    }
    for field in fields:
        if not field.type.primitive:
            _describe(field.type.base, described)


def description(name: str) -> dict[str, Any]:
    """The fields of type_description_interfaces/msg/TypeDescription of a type."""
    described: dict[str, dict[str, Any]] = {}
    _describe(name, described)
    return {
        "type_description": described.pop(name),
        "referenced_type_descriptions": [described[key] for key in sorted(described)],
    }


@cache
def type_hash(name: str) -> str:
    """Hash of a message, a service or an action, `RIHS01_` and 64 hexadecimal digits.

    Args:
        name: full name, e.g. `sensor_msgs/msg/JointState`.
    """
    return "RIHS01_" + hashlib.sha256(json.dumps(description(name)).encode()).hexdigest()
