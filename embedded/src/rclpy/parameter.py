"""Parameters: a name, a type and a value."""

from __future__ import annotations

import array
from collections.abc import Callable, Iterable, Sequence
from enum import Enum
from pathlib import Path
from typing import Any

import yaml
from ros2_embedded.messages import message_class

PARAMETER_SEPARATOR_STRING = "."


class Parameter:
    """A parameter of a node."""

    class Type(Enum):
        """Types, numbered as in rcl_interfaces/msg/ParameterType."""

        NOT_SET = 0
        BOOL = 1
        INTEGER = 2
        DOUBLE = 3
        STRING = 4
        BYTE_ARRAY = 5
        BOOL_ARRAY = 6
        INTEGER_ARRAY = 7
        DOUBLE_ARRAY = 8
        STRING_ARRAY = 9

        @classmethod
        def from_parameter_value(cls, parameter_value: Any) -> Parameter.Type:
            """The type of a value; an empty row is one of bytes.

            Raises:
                TypeError: a value that no parameter can have.
            """
            if parameter_value is None:
                return cls.NOT_SET
            if isinstance(parameter_value, (list, tuple, array.array)):
                return cls._of_row(parameter_value)
            for kind, name in _SCALARS:
                if isinstance(parameter_value, kind):
                    return cls[name]
            raise TypeError(f"The given value is not one of the allowed types '{parameter_value}'.")

        @classmethod
        def _of_row(cls, row: Iterable[Any]) -> Parameter.Type:
            for kind, name in ((bytes, "BYTE"), *_SCALARS):
                if all(isinstance(item, kind) for item in row):
                    return cls[f"{name}_ARRAY"]
            raise TypeError(f"The given value is not a list of one of the allowed types '{row}'.")

        def check(self, parameter_value: Any) -> bool:
            """Whether a value is of this type."""
            return bool(_CHECKS[self.name](parameter_value))

    def __init__(self, name: str, type_: Parameter.Type | None = None, value: Any = None) -> None:
        """Creates a parameter; without `type_` the type follows from the value.

        Raises:
            ValueError: the value is not of the type.
            TypeError: No parameter can have this value, or `type_` is not a Parameter.Type.
        """
        if type_ is None:
            type_ = Parameter.Type.from_parameter_value(value)
        if not isinstance(type_, Parameter.Type):
            raise TypeError(f"type must be an instance of '{Parameter.Type!r}'")
        if not type_.check(value):
            raise ValueError(f"Type '{type_}' and value '{value}' do not agree")
        self._name, self._type, self._value = name, type_, value

    @property
    def name(self) -> str:
        """The name."""
        return self._name

    @property
    def type_(self) -> Parameter.Type:
        """The type."""
        return self._type

    @property
    def value(self) -> Any:
        """The value."""
        return self._value

    def __repr__(self) -> str:
        """A text with name, type and value."""
        return f"Parameter({self._name!r}, {self._type}, {self._value!r})"

    def get_parameter_value(self) -> Any:
        """Converts the value to rcl_interfaces/msg/ParameterValue."""
        message = message_class("rcl_interfaces/msg/ParameterValue")(type=self._type.value)
        if self._type is not Parameter.Type.NOT_SET:
            setattr(message, _slot(self._type), self._value)
        return message

    def to_parameter_msg(self) -> Any:
        """Converts the parameter to rcl_interfaces/msg/Parameter."""
        message = message_class("rcl_interfaces/msg/Parameter")
        return message(name=self._name, value=self.get_parameter_value())

    @classmethod
    def from_parameter_msg(cls, param_msg: Any) -> Parameter:
        """Converts rcl_interfaces/msg/Parameter; arrays of numbers become an `array.array`."""
        kind = cls.Type(param_msg.value.type)
        unset = kind is cls.Type.NOT_SET
        return cls(param_msg.name, kind, None if unset else getattr(param_msg.value, _slot(kind)))


_SCALARS: tuple[tuple[type, str], ...] = (
    (bool, "BOOL"), (int, "INTEGER"), (float, "DOUBLE"), (str, "STRING"),
)  # fmt: skip


def _is(kind: type) -> Callable[[Any], bool]:
    return lambda value: isinstance(value, kind)


def _is_row(kind: type, *rows: type) -> Callable[[Any], bool]:
    def check(value: Any) -> bool:
        known = isinstance(value, (list, tuple, *rows))
        return known and all(isinstance(item, kind) for item in value)

    return check


def _is_row_of_bytes(value: Any) -> bool:
    return _is_row(bytes)(value) and all(len(item) == 1 for item in value)


_CHECKS: dict[str, Callable[[Any], bool]] = {
    "NOT_SET": lambda value: value is None,
    **{name: _is(kind) for kind, name in _SCALARS},
    "BYTE_ARRAY": _is_row_of_bytes,
    "BOOL_ARRAY": _is_row(bool),
    "INTEGER_ARRAY": _is_row(int, array.array),
    "DOUBLE_ARRAY": _is_row(float, array.array),
    "STRING_ARRAY": _is_row(str),
}


def _slot(kind: Parameter.Type) -> str:
    return f"{kind.name.lower()}_value"


def parameter_value_to_python(parameter_value: Any) -> Any:
    """The value in a rcl_interfaces/msg/ParameterValue.

    Raises:
        RuntimeError: The type of the value is unknown.
    """
    try:
        kind = Parameter.Type(parameter_value.type)
    except ValueError:
        raise RuntimeError(f"unexpected parameter type {parameter_value.type}") from None
    if kind is Parameter.Type.NOT_SET:
        return None
    value = getattr(parameter_value, _slot(kind))
    return list(value) if kind.name.endswith("_ARRAY") else value


def get_parameter_value(string_value: str) -> Any:
    """The rcl_interfaces/msg/ParameterValue that a text in YAML means."""
    try:
        value = yaml.safe_load(string_value)
    except yaml.parser.ParserError:
        value = string_value
    if value is None:
        value = string_value
    try:
        kind = Parameter.Type.from_parameter_value(value)
    except TypeError:
        kind, value = Parameter.Type.STRING, string_value
    if value == []:
        kind = Parameter.Type.BOOL_ARRAY
    return Parameter("", kind, value).get_parameter_value()


def parameter_dict_from_yaml_file(
    parameter_file: str,
    use_wildcard: bool = False,
    target_nodes: Sequence[str] | None = None,
    namespace: str = "",
) -> dict[str, Any]:
    """Reads a parameter file into messages of rcl_interfaces/msg/Parameter, by name.

    Args:
        parameter_file: path of the file.
        use_wildcard: whether what stands below `/**` counts; a node's own values win over it.
        target_nodes: the nodes whose parameters are wanted, as they stand in the file; None: all.
        namespace: what to put before the names.

    Raises:
        RuntimeError: a node is not in the file, or the file is no parameter file.
    """
    tree = yaml.safe_load(Path(parameter_file).read_text(encoding="utf-8"))
    keys = ["/**"] if use_wildcard and "/**" in tree else []
    for node in target_nodes or ():
        if node not in tree:
            raise RuntimeError(
                f"Param file does not contain parameters for {node},only for nodes: {list(tree)} "
            )
    keys += target_nodes or [key for key in tree if key != "/**"]
    if not keys:
        raise RuntimeError("Param file does not contain selected parameters")
    values: dict[str, Any] = {}
    for key in keys:
        if not isinstance(tree[key], dict) or "ros__parameters" not in tree[key]:
            raise RuntimeError(f"YAML file is not a valid ROS parameter file for node {key}")
        values.update(tree[key]["ros__parameters"])
    return _unpack(namespace, values)


def _unpack(namespace: str, values: dict[str, Any]) -> dict[str, Any]:
    message = message_class("rcl_interfaces/msg/Parameter")
    found: dict[str, Any] = {}
    for key, value in values.items():
        name = f"{namespace}{key}"
        if isinstance(value, dict):
            found.update(_unpack(name + PARAMETER_SEPARATOR_STRING, value))
        else:
            found[name] = message(name=name, value=get_parameter_value(str(value)))
    return found
