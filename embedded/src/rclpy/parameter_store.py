"""A node's parameters: declaration, types, ranges, callbacks."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from ros2_embedded.messages import message_class

from rclpy.exceptions import (
    InvalidParameterTypeException,
    InvalidParameterValueException,
    ParameterAlreadyDeclaredException,
    ParameterNotDeclaredException,
    ParameterUninitializedException,
)
from rclpy.parameter import Parameter

Type = Parameter.Type
Callback = Callable[[list[Parameter]], Any]
_UNSET = object()


def _result(reason: str = "") -> Any:
    message = message_class("rcl_interfaces/msg/SetParametersResult")
    return message(successful=not reason, reason=reason)


def _range_error(parameter: Parameter, descriptor: Any) -> str:
    """Why the descriptor's range refuses a value; empty if it does not."""
    if parameter.type_ == Type.INTEGER and descriptor.integer_range:
        limits = descriptor.integer_range[0]
    elif parameter.type_ == Type.DOUBLE and descriptor.floating_point_range:
        limits = descriptor.floating_point_range[0]
    else:
        return ""
    low, high, step, value = limits.from_value, limits.to_value, limits.step, parameter.value
    if not low <= value <= high:
        return f"{value} is out of the range [{low}, {high}]"
    on_step = not step or math.isclose(round((value - low) / step), (value - low) / step)
    if value != high and not on_step:
        return f"{value} is not {low} plus a multiple of {step}"
    return ""


class ParameterStore:
    """The parameters of one node and the rules for them."""

    def __init__(self, overrides: dict[str, Any], allow_undeclared: bool) -> None:
        """`overrides` are the command line's values: they replace the defaults."""
        self.overrides, self.allow_undeclared = overrides, allow_undeclared
        self.parameters: dict[str, Parameter] = {}
        self.descriptors: dict[str, Any] = {}
        self.callbacks: list[Callback] = []
        self.post_callbacks: list[Callable[[list[Parameter]], Any]] = []

    def declare(
        self, name: str, value: Any, descriptor: Any, ignore_override: bool = False
    ) -> Parameter:
        """Declares a parameter.

        Args:
            name: its name.
            value: default, or a `Parameter.Type` for a parameter without one, or None.
            descriptor: rcl_interfaces/msg/ParameterDescriptor, or None.
            ignore_override: whether to leave the command line's value aside.

        Raises:
            ParameterAlreadyDeclaredException: it is there already.
            InvalidParameterTypeException: the command line's value is of another type.
            InvalidParameterValueException: the value is refused.
        """
        if name in self.parameters:
            raise ParameterAlreadyDeclaredException(name)
        if descriptor is None:
            descriptor = message_class("rcl_interfaces/msg/ParameterDescriptor")()
        if not name or name.strip() != name:
            raise ValueError(f"Invalid parameter name: '{name}'")
        kind, default = Type.NOT_SET, value
        if isinstance(value, Parameter.Type):
            kind, default = value, None
        elif value is not None:
            kind = Type.from_parameter_value(value)
        descriptor.name, descriptor.type = name, int(kind)
        if value is None:
            descriptor.dynamic_typing = True
        chosen = default if ignore_override else self.overrides.get(name, default)
        parameter = Parameter(name, value=chosen)
        if chosen is not None:
            parameter = self._typed(parameter, descriptor)
        result = self._check([parameter], {name: descriptor})
        if chosen is not None and not result.successful:
            raise InvalidParameterValueException(name, chosen, result.reason)
        self.descriptors[name] = descriptor
        self.parameters[name] = parameter
        return parameter

    def _typed(self, parameter: Parameter, descriptor: Any) -> Parameter:
        """The parameter with the declared type; an empty list fits every array."""
        expected = Type(descriptor.type)
        if descriptor.dynamic_typing or expected in (Type.NOT_SET, parameter.type_):
            return parameter
        if parameter.value in ([], ()) and expected >= Type.BYTE_ARRAY:
            return Parameter(parameter.name, expected, [])
        raise InvalidParameterTypeException(parameter, expected.name)

    def _check(self, parameters: list[Parameter], descriptors: dict[str, Any]) -> Any:
        """Ranges first, then the node's callbacks."""
        for parameter in parameters:
            reason = _range_error(parameter, descriptors[parameter.name])
            if reason:
                return _result(f"Parameter {parameter.name}: {reason}")
        for callback in self.callbacks:
            result = callback(parameters)
            if not result.successful:
                return result
        return _result()

    def get(self, name: str, alternative: Any = _UNSET) -> Parameter:
        """A parameter.

        Raises:
            ParameterNotDeclaredException: there is none, and no alternative.
            ParameterUninitializedException: it has a type but no value yet.
        """
        parameter = self.parameters.get(name)
        if parameter is None:
            if alternative is not _UNSET:
                return Parameter(name, value=alternative)
            if self.allow_undeclared:
                return Parameter(name)
            raise ParameterNotDeclaredException(name)
        descriptor = self.descriptors[name]
        if parameter.value is None and not descriptor.dynamic_typing:
            raise ParameterUninitializedException(name)
        return parameter

    def set_atomically(self, parameters: Sequence[Parameter]) -> Any:
        """Sets all or none; returns a SetParametersResult.

        Raises:
            ParameterNotDeclaredException: one has not been declared.
        """
        typed: list[Parameter] = []
        for parameter in parameters:
            if parameter.name not in self.parameters:
                if not self.allow_undeclared:
                    raise ParameterNotDeclaredException(parameter.name)
                self.declare(parameter.name, parameter.value, None, ignore_override=True)
            descriptor = self.descriptors[parameter.name]
            if descriptor.read_only:
                return _result(f"Trying to set a read-only parameter: {parameter.name}.")
            try:
                typed.append(self._typed(parameter, descriptor))
            except InvalidParameterTypeException as error:
                return _result(str(error))
        result = self._check(typed, self.descriptors)
        if result.successful:
            self.parameters.update({parameter.name: parameter for parameter in typed})
            for callback in self.post_callbacks:
                callback(typed)
        return result
