"""Python classes of messages: Cyclone DDS structs that check what is put into their fields."""

from __future__ import annotations

import array
import math
from collections.abc import Callable, Iterable
from types import new_class
from typing import Any, ClassVar

import numpy as np
from cyclonedds.idl import IdlStruct
from cyclonedds.idl import types as _idl_types

from ros2_embedded import cdr
from ros2_embedded.catalogue import message_spec
from ros2_embedded.specs import DUMMY_FIELD, INTEGER_BITS, TYPECODES, FieldType, MessageSpec
from ros2_embedded.thread_safety import once

idl: Any = _idl_types
Checker = Callable[[str, Any], Any]
_LARGEST_SINGLE = 3.4028234663852886e38

_IDL_NAMES = {
    "bool": "boolean", "byte": "octet", "char": "uint8", "float32": "float", "float64": "double",
}  # fmt: skip
_IDL_TYPES = {
    "bool": bool, "string": str, "char": idl.uint8, "byte": idl.array[idl.uint8, 1],
    **{name: getattr(idl, name) for name in [*INTEGER_BITS, "float32", "float64"]},
}  # fmt: skip


class Message:
    """Base of all messages. A value that a field's definition forbids is an AssertionError."""

    _spec: ClassVar[MessageSpec]
    _checks: ClassVar[dict[str, Checker]]
    _initial: ClassVar[dict[str, Checker]]
    _defaults: ClassVar[dict[str, Callable[[], Any]]]

    def __init__(self, **fields: Any) -> None:
        """Sets the given fields, and the others to their defaults."""
        values, initial = self.__dict__, self._initial
        for name, value in fields.items():
            if name not in initial:
                wrong = ", ".join(sorted(fields.keys() - initial.keys()))
                raise AssertionError(f"Invalid arguments passed to constructor: {wrong}")
            values[name] = initial[name](name, value)
        for name, default in self._defaults.items():
            if name not in values:
                values[name] = default()

    def __setattr__(self, name: str, value: Any) -> None:
        """Checks a value and sets the field."""
        check = self._checks.get(name)
        if check is not None:
            self.__dict__[name] = check(name, value)
        else:
            raise AttributeError(f"'{type(self).__name__}' object has no attribute '{name}'")

    def __eq__(self, other: object) -> bool:
        """Whether the types and all fields are the same."""
        if type(other) is not type(self):
            return NotImplemented
        mine, theirs = self.__dict__, other.__dict__
        return all(_same(mine[f.name], theirs[f.name]) for f in self._spec.fields)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        """The text that rclpy writes, such as `std_msgs.msg.String(data='text')`."""
        cls = type(self)
        fields = (f"{f.name}={_shown(self.__dict__[f.name])}" for f in self._spec.fields)
        return f"{cls.__module__}.{cls.__qualname__}({', '.join(fields)})"

    @classmethod
    def get_fields_and_field_types(cls) -> dict[str, str]:
        """Names of the fields and their types as IDL writes them."""
        return {f.name: _idl_text(f.type) for f in cls._spec.fields}


def _serialize(self: Any) -> bytes:
    """Returns the header and the CDR of the message."""
    return cdr.serialize(self._spec.name, self)


def _same(left: Any, right: Any) -> bool:
    if isinstance(left, np.ndarray):
        return bool(np.array_equal(left, right))
    return bool(left == right)


def _shown(value: Any) -> str:
    if isinstance(value, array.array):
        return repr(value.tolist())
    return repr(value)


def _idl_text(kind: FieldType) -> str:
    text = _IDL_NAMES.get(kind.base, kind.base.replace("/msg/", "/"))
    if kind.string_bound:
        text = f"string<{kind.string_bound}>"
    if kind.container == "array":
        return f"{text}[{kind.size}]"
    if kind.container == "sequence":
        return f"sequence<{text}, {kind.size}>" if kind.size else f"sequence<{text}>"
    return text


def _refuse(name: str, expected: str, value: Any) -> AssertionError:
    return AssertionError(f"The '{name}' field must be {expected}, not {value!r}")


def _scalar_check(kind: FieldType) -> Checker:
    """Check of one element."""
    base = kind.base
    if base in INTEGER_BITS or base == "char":
        bits = INTEGER_BITS.get(base, 8)
        low, high = (
            (-(1 << bits - 1), (1 << bits - 1) - 1) if base[0] == "i" else (0, (1 << bits) - 1)
        )

        def integer(name: str, value: Any) -> int:
            if not isinstance(value, int):  # a bool is one, as in rclpy
                raise _refuse(name, "of type 'int'", value)
            if not low <= value <= high:
                raise _refuse(name, f"an integer in [{low}, {high}]", value)
            return value

        return integer
    if base == "byte":

        def byte(name: str, value: Any) -> bytes:
            if not isinstance(value, (bytes, bytearray)) or len(value) != 1:
                raise _refuse(name, "of type 'bytes' or 'ByteString' with length 1", value)
            return bytes(value)

        return byte
    if base == "string" and kind.string_bound:

        def bounded(name: str, value: Any) -> str:
            if not isinstance(value, str) or len(value) > kind.string_bound:
                raise _refuse(name, f"a string of at most {kind.string_bound} characters", value)
            return value

        return bounded
    if base == "float32":

        def single(name: str, value: Any) -> float:
            if not isinstance(value, float):
                raise _refuse(name, "of type 'float'", value)
            if abs(value) > _LARGEST_SINGLE and not math.isinf(value):
                raise _refuse(name, "a float in [-3.402823466e+38, 3.402823466e+38]", value)
            return value

        return single
    types: dict[str, type] = {"bool": bool, "float64": float, "string": str}
    wanted = types[base] if kind.primitive else message_class(base)
    what = f"{'of' if kind.primitive else 'a sub message of'} type '{wanted.__name__}'"

    def instance(name: str, value: Any) -> Any:
        if not isinstance(value, wanted):
            raise _refuse(name, what, value)
        return value

    return instance


def _check_size(name: str, value: Any, kind: FieldType) -> None:
    if kind.container == "array" and len(value) != kind.size:
        raise _refuse(name, f"of length {kind.size}", value)
    if kind.container == "sequence" and kind.size and len(value) > kind.size:
        raise _refuse(name, f"of at most {kind.size} elements", value)


def _is_sequence(value: Any) -> bool:
    return isinstance(value, Iterable) and not isinstance(value, (str, bytes, dict))


def _numeric_check(kind: FieldType) -> Checker:
    """Check of arrays of numbers: array.array, or a numpy array if the length is fixed."""
    code = TYPECODES[kind.base]
    dtype = np.dtype(code)
    kinds = "f" if dtype.kind == "f" else "iu"
    element = _scalar_check(FieldType(kind.base))
    row = f"a set or sequence and each value of type '{'float' if dtype.kind == 'f' else 'int'}'"
    exact = {float} if dtype.kind == "f" else {int, bool}
    fixed = kind.container == "array"

    def numbers(name: str, value: Any) -> Any:
        if isinstance(value, np.ndarray):
            if value.dtype.kind not in kinds or value.ndim != 1:
                raise _refuse(name, row, value)
            values: Any = array.array(code, value.tolist())
        elif isinstance(value, array.array) and value.typecode == code:
            values = value
        elif isinstance(value, bytes) and code == "B":
            values = array.array("B", value)
        elif _is_sequence(value):
            values = list(value)
            if not set(map(type, values)) <= exact:
                for item in values:
                    element(name, item)
            try:
                values = array.array(code, values)
            except OverflowError as error:
                raise _refuse(name, row, value) from error
        else:
            raise _refuse(name, row, value)
        _check_size(name, values, kind)
        return np.array(values, dtype) if fixed else values

    return numbers


def _list_check(kind: FieldType) -> Checker:
    """Check of arrays of strings, booleans, bytes or messages: a list."""
    element = _scalar_check(FieldType(kind.base, string_bound=kind.string_bound))
    word = {"string": "str", "byte": "bytes"}.get(kind.base, kind.base.rpartition("/")[2])
    row = f"a set or sequence and each value of type '{word}'"

    def items(name: str, value: Any) -> list[Any]:
        if not _is_sequence(value):
            raise _refuse(name, row, value)
        try:
            values = [element(name, item) for item in value]
        except AssertionError:
            raise _refuse(name, row, value) from None
        _check_size(name, values, kind)
        return values

    return items


def _initial(kind: FieldType, check: Checker) -> Checker:
    """Check of what the constructor is given: as in rclpy, it turns rows of numbers into arrays."""
    if kind.container != "sequence" or kind.base not in TYPECODES:
        return check
    code = TYPECODES[kind.base]

    def converted(name: str, value: Any) -> Any:
        row = value.tolist() if isinstance(value, np.ndarray) else value
        return check(name, array.array(code, row))

    return converted


def _check(kind: FieldType) -> Checker:
    if not kind.container:
        return _scalar_check(kind)
    return _numeric_check(kind) if kind.base in TYPECODES else _list_check(kind)


def _default(kind: FieldType, given: Any) -> Callable[[], Any]:
    """Returns a function that makes a field's default value; each message has its own list."""
    if kind.container:
        if given is None:
            scalar = _default(FieldType(kind.base, string_bound=kind.string_bound), None)
            check, count = _check(kind), kind.size if kind.container == "array" else 0
            return lambda: check("default", [scalar() for _ in range(count)])
        check = _check(kind)
        return lambda: check("default", given)
    if not kind.primitive:
        return message_class(kind.base)
    if given is None:
        given = {"string": "", "bool": False, "byte": b"\0"}.get(
            kind.base, 0.0 if kind.base.startswith("float") else 0
        )
    return lambda: given


def _idl_type(kind: FieldType) -> Any:
    element = _IDL_TYPES[kind.base] if kind.primitive else message_class(kind.base)
    if kind.string_bound:
        element = idl.bounded_str[kind.string_bound]
    if kind.container == "array":
        return idl.array[element, kind.size]
    if kind.container == "sequence":
        return idl.sequence[element, kind.size] if kind.size else idl.sequence[element]
    return element


def dds_type_name(name: str) -> str:
    """ROS 2's DDS name of a type: `pkg/msg/Name` is `pkg::msg::dds_::Name_`."""
    package, kind, short = name.split("/")
    return f"{package}::{kind}::dds_::{short}_"


@once
def message_class(name: str) -> Any:
    """Class of a message: `pkg/msg/Name`, `pkg/srv/Name_Request`, `pkg/action/Name_Goal`, ...

    Raises:
        InterfaceError: there is no such message.
    """
    spec = message_spec(name)
    package, kind, short = name.split("/")
    annotations = {f.name: _idl_type(f.type) for f in spec.wire_fields}
    # IdlStruct must be the first base: Cyclone DDS takes another one for a parent struct.
    cls: Any = new_class(
        short,
        (IdlStruct, Message),
        {"typename": dds_type_name(name)},
        lambda namespace: namespace.update(
            __annotations__=annotations,
            serialize=_serialize,
            deserialize=staticmethod(cdr.deserializer(name, message_class)),
        ),
    )
    cls.__module__ = f"{package}.{kind}"
    cls._spec = spec
    cls._checks = {f.name: _check(f.type) for f in spec.wire_fields}
    cls._initial = {f.name: _initial(f.type, cls._checks[f.name]) for f in spec.wire_fields}
    cls._defaults = {f.name: _default(f.type, f.default) for f in spec.wire_fields}
    for constant in spec.constants:
        setattr(cls, constant.name, constant.value)
    for field in spec.fields:
        if field.default is not None:
            setattr(cls, f"{field.name.upper()}__DEFAULT", field.default)
    return cls


def full_type_name(cls: Any) -> str:
    """Name of a message's type, `pkg/msg/Name`."""
    return str(cls._spec.name)


def is_hidden(field: str) -> bool:
    """Whether a field is there for IDL's sake only."""
    return field == DUMMY_FIELD
