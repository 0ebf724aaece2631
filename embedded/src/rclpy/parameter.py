"""Parameters: a name, a type and a value."""

from __future__ import annotations

import array
from enum import IntEnum
from typing import Any

from ros2_embedded.messages import message_class


class Parameter:
    """A parameter of a node."""

    class Type(IntEnum):
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
        def from_parameter_value(cls, value: Any) -> Parameter.Type:
            """The type of a value.

            Raises:
                TypeError: a value that no parameter can have.
            """
            if value is None:
                return cls.NOT_SET
            scalars = {bool: cls.BOOL, int: cls.INTEGER, float: cls.DOUBLE, str: cls.STRING}
            for python, kind in scalars.items():
                if isinstance(value, python):
                    return kind
            if isinstance(value, array.array):
                return cls.INTEGER_ARRAY if value.typecode == "q" else cls.DOUBLE_ARRAY
            if isinstance(value, (list, tuple)):
                if all(isinstance(item, bytes) for item in value):
                    return cls.BYTE_ARRAY
                for python, kind in scalars.items():
                    if all(isinstance(item, python) for item in value):
                        has_bool = any(isinstance(item, bool) for item in value)
                        if python is not int or not has_bool:
                            return cls(kind + 5)
            raise TypeError(f"{value!r} cannot be the value of a parameter")

    def __init__(self, name: str, type_: Parameter.Type | None = None, value: Any = None) -> None:
        """Takes the type from the value if none is given.

        Raises:
            ValueError: the value is not of the type.
        """
        found = self.Type.from_parameter_value(value)
        if type_ is not None and type_ not in (found, self.Type.NOT_SET) and value not in ([], ()):
            raise ValueError(f"Type '{type_.name}' and value '{value!r}' do not agree")
        self.name, self.value = name, value
        self.type_ = found if type_ is None else type_

    def __repr__(self) -> str:
        """With name, type and value."""
        return f"Parameter({self.name!r}, {self.type_.name}, {self.value!r})"

    def __eq__(self, other: object) -> bool:
        """Same name, type and value."""
        return isinstance(other, Parameter) and vars(self) == vars(other)

    def get_parameter_value(self) -> Any:
        """As rcl_interfaces/msg/ParameterValue."""
        message = message_class("rcl_interfaces/msg/ParameterValue")(type=int(self.type_))
        if self.type_ != self.Type.NOT_SET:
            setattr(message, _slot(self.type_), self.value)
        return message

    def to_parameter_msg(self) -> Any:
        """As rcl_interfaces/msg/Parameter."""
        message = message_class("rcl_interfaces/msg/Parameter")
        return message(name=self.name, value=self.get_parameter_value())

    @classmethod
    def from_parameter_msg(cls, message: Any) -> Parameter:
        """From rcl_interfaces/msg/Parameter."""
        value = parameter_value_to_python(message.value)
        return cls(message.name, cls.Type(message.value.type), value)


def _slot(kind: Parameter.Type) -> str:
    return f"{kind.name.lower()}_value"


def parameter_value_to_python(message: Any) -> Any:
    """Value that a rcl_interfaces/msg/ParameterValue holds."""
    if message.type == Parameter.Type.NOT_SET:
        return None
    value = getattr(message, _slot(Parameter.Type(message.type)))
    return value.tolist() if isinstance(value, array.array) else value


PARAMETER_SEPARATOR_STRING = "."
