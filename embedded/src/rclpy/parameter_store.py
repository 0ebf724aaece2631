"""A node's parameters: declaration, types, ranges, callbacks."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from typing import Any

from ros2_embedded.messages import message_class

from rclpy.exceptions import (
    InvalidParameterException,
    InvalidParameterTypeException,
    InvalidParameterValueException,
    ParameterAlreadyDeclaredException,
    ParameterImmutableException,
    ParameterNotDeclaredException,
    ParameterUninitializedException,
)
from rclpy.parameter import Parameter
from rclpy.parameter_ranges import refusal

Type = Parameter.Type


def new_descriptor(**fields: Any) -> Any:
    """A rcl_interfaces/msg/ParameterDescriptor."""
    return message_class("rcl_interfaces/msg/ParameterDescriptor")(**fields)


def set_result(reason: str = "") -> Any:
    """A SetParametersResult: a failure if there is a reason."""
    message = message_class("rcl_interfaces/msg/SetParametersResult")
    return message(successful=not reason, reason=reason)


class ParameterStore:
    """The parameters of one node and the rules for them."""

    def __init__(
        self,
        overrides: dict[str, Parameter],
        allow_undeclared: bool,
        tell: Callable[[list[Parameter], list[Parameter], list[Parameter]], None],
    ) -> None:
        """`overrides` replace defaults; `tell` receives new, changed and deleted parameters."""
        self.overrides, self.allow_undeclared, self._tell = overrides, allow_undeclared, tell
        self.parameters: dict[str, Parameter] = {}
        self.descriptors: dict[str, Any] = {}
        self.pre_callbacks: list[Callable[[list[Parameter]], list[Parameter]]] = []
        self.callbacks: list[Callable[[list[Parameter]], Any]] = []
        self.post_callbacks: list[Callable[[list[Parameter]], None]] = []

    # Declaring.

    def declare(
        self, namespace: str, items: Sequence[tuple[Any, ...]], ignore_override: bool
    ) -> list[Parameter]:
        """Declares parameters.

        Args:
            namespace: Prefix of the names, which is followed by a dot.
            items: Tuples of name, default value or type, and descriptor.
            ignore_override: Whether to ignore the values of the command line.

        Raises:
            TypeError: a tuple of another form.
            ValueError: the default gives no type, and the typing is not dynamic.
            InvalidParameterException: an empty name.
            ParameterAlreadyDeclaredException: one is there already.
            InvalidParameterTypeException: the command line's value is of another type.
            InvalidParameterValueException: a range or a callback refuses the value.
        """
        parameters, descriptors = [], {}
        for index, item in enumerate(items):
            name, default, descriptor = _unpacked(namespace, index, item)
            value = _settle_type(name, default, descriptor)
            if not ignore_override and name in self.overrides:
                value = self.overrides[name].value
            parameters.append(Parameter(name, value=value))
            descriptors[name] = descriptor
        known = [parameter.name for parameter in parameters if parameter.name in self.parameters]
        if known:
            raise ParameterAlreadyDeclaredException(known)
        for parameter in parameters:
            self._declare_one(parameter, descriptors)
        return [self.parameters[parameter.name] for parameter in parameters]

    def _declare_one(self, parameter: Parameter, descriptors: dict[str, Any]) -> None:
        result = self._set([parameter], descriptors, keep_unset=True)
        if result.successful:
            return
        if result.reason.startswith("Wrong parameter type"):
            expected = Type(descriptors[parameter.name].type)
            raise InvalidParameterTypeException(parameter, expected.name)
        raise InvalidParameterValueException(parameter.name, parameter.value, result.reason)

    def undeclare(self, name: str) -> None:
        """Removes a declared parameter.

        Raises:
            ParameterNotDeclaredException: The parameter is not declared.
            ParameterImmutableException: it is read-only.
        """
        if name not in self.parameters:
            raise ParameterNotDeclaredException(name)
        if self.descriptors[name].read_only:
            raise ParameterImmutableException(name)
        del self.parameters[name], self.descriptors[name]

    # Looking.

    def get(self, name: str) -> Parameter:
        """A parameter.

        Raises:
            ParameterNotDeclaredException: The parameter is not declared.
            ParameterUninitializedException: it has a type but no value yet.
        """
        parameter = self.parameters.get(name)
        if parameter is None:
            if self.allow_undeclared:
                return Parameter(name)
            raise ParameterNotDeclaredException(name)
        if parameter.type_ is Type.NOT_SET and not self.descriptors[name].dynamic_typing:
            raise ParameterUninitializedException(name)
        return parameter

    def get_or(self, name: str, alternative: Parameter | None) -> Parameter:
        """Returns a parameter if it has a value, otherwise the alternative or an unset one."""
        parameter = self.parameters.get(name)
        if parameter is None or parameter.type_ is Type.NOT_SET:
            return Parameter(name) if alternative is None else alternative
        return parameter

    def describe(self, name: str) -> Any:
        """The descriptor of a parameter.

        Raises:
            ParameterNotDeclaredException: The parameter is not declared.
        """
        if name in self.descriptors:
            return self.descriptors[name]
        if self.allow_undeclared:
            return new_descriptor()
        raise ParameterNotDeclaredException(name)

    # Setting.

    def set_atomically(self, parameters: Sequence[Parameter]) -> Any:
        """Sets all parameters or no parameter; returns a SetParametersResult.

        Raises:
            TypeError: one is no Parameter.
            ParameterNotDeclaredException: one has not been declared.
        """
        chosen = list(parameters)
        if self.pre_callbacks:
            chosen = [item for callback in self.pre_callbacks for item in callback(chosen)]
            if not chosen:
                return set_result(
                    "parameter list cannot be empty, this might be due to "
                    "pre_set_parameters_callback modifying the original parameters list."
                )
        if not all(isinstance(parameter, Parameter) for parameter in chosen):
            raise TypeError(f"parameter must be instance of type '{Parameter!r}'")
        unknown = [item.name for item in chosen if item.name not in self.parameters]
        if unknown and not self.allow_undeclared:
            raise ParameterNotDeclaredException(unknown[1:])
        return self._set(chosen, None, keep_unset=False)

    def _set(
        self, parameters: list[Parameter], descriptors: dict[str, Any] | None, keep_unset: bool
    ) -> Any:
        """Descriptors first, then the node's callbacks; new descriptors come with a declaration."""
        rules = self.descriptors if descriptors is None else descriptors
        for parameter in parameters:
            if parameter.name in rules:
                reason = self._refusal(parameter, rules[parameter.name], descriptors is None)
                if reason:
                    return set_result(reason)
        for callback in self.callbacks:
            result = callback(parameters)
            if not result.successful:
                return result
        self._store(parameters, descriptors or {}, keep_unset)
        for told in self.post_callbacks:
            told(parameters)
        return set_result()

    def _refusal(self, parameter: Parameter, descriptor: Any, check_read_only: bool) -> str:
        descriptor.name = parameter.name
        declared = parameter.name in self.parameters
        reason = refusal(parameter, descriptor, declared, check_read_only)
        if descriptor.dynamic_typing and not (check_read_only and descriptor.read_only):
            descriptor.type = parameter.type_.value
        return reason

    def _store(
        self, parameters: list[Parameter], descriptors: dict[str, Any], keep_unset: bool
    ) -> None:
        new: list[Parameter] = []
        changed: list[Parameter] = []
        deleted: list[Parameter] = []
        for parameter in parameters:
            name = parameter.name
            if parameter.type_ is Type.NOT_SET and not keep_unset:
                deleted.append(parameter)
                self.parameters.pop(name, None)
                self.descriptors.pop(name, None)
                continue
            if name in descriptors:
                self.descriptors[name] = descriptors[name]
            elif name not in self.descriptors:
                self.descriptors[name] = new_descriptor(dynamic_typing=True)
            old = self.get_or(name, None)
            (new if old.type_ is Type.NOT_SET else changed).append(parameter)
            self.parameters[name] = parameter
        self._tell(new, changed, deleted)

    def set_descriptor(self, name: str, descriptor: Any, alternative: Any) -> Any:
        """Sets a new descriptor; returns the value that the parameter has then, as a message.

        Raises:
            ParameterNotDeclaredException: there is no such parameter.
            ParameterImmutableException: it is read-only.
            InvalidParameterValueException: neither its value nor the alternative is allowed.
        """
        if name not in self.parameters:
            return self.get(name).get_parameter_value()
        if self.describe(name).read_only:
            raise ParameterImmutableException(name)
        current = self.get(name)
        if self._refusal(current, descriptor, False):
            if alternative is not None:
                message = message_class("rcl_interfaces/msg/Parameter")
                current = Parameter.from_parameter_msg(message(name=name, value=alternative))
            reason = self._refusal(current, descriptor, False)
            if reason:
                raise InvalidParameterValueException(name, current.value, reason)
        self.parameters[name], self.descriptors[name] = current, descriptor
        return self.get(name).get_parameter_value()


def _unpacked(namespace: str, index: int, item: tuple[Any, ...]) -> tuple[str, Any, Any]:
    """The name, default value and descriptor of a tuple, which may be shorter."""
    if not 1 <= len(item) <= 3:
        raise TypeError(
            f"Invalid parameter tuple length at index {index} in parameters list: "
            f"{item}; expecting length between 1 and 3"
        )
    name = item[0]
    if not isinstance(name, str):
        raise TypeError(f"First element {name} at index {index} in parameters list is not a str.")
    name = f"{namespace}.{name}" if namespace else name
    if not name:
        raise InvalidParameterException(name)
    descriptor = item[2] if len(item) == 3 else new_descriptor()
    if not isinstance(descriptor, message_class("rcl_interfaces/msg/ParameterDescriptor")):
        raise TypeError(
            f"Third element {descriptor} at index {index} in parameters list "
            "is not a ParameterDescriptor."
        )
    if len(item) == 1:
        warnings.warn(
            f"when declaring parameter named '{name}', declaring a parameter only providing its "
            "name is deprecated. You have to either:\n"
            '\t- Pass a name and a default value different to "PARAMETER NOT SET"'
            " (and optionally a descriptor).\n"
            "\t- Pass a name and a parameter type.\n"
            "\t- Pass a name and a descriptor with `dynamic_typing=True",
            stacklevel=5,
        )
        descriptor.dynamic_typing = True
    return name, item[1] if len(item) > 1 else None, descriptor


def _settle_type(name: str, default: Any, descriptor: Any) -> Any:
    """Writes the type into the descriptor; returns the default value or None."""
    if isinstance(default, Type):
        if default is Type.NOT_SET:
            raise ValueError(
                f"Cannot declare parameter {{{name}}} as statically typed of type NOT_SET"
            )
        if descriptor.dynamic_typing:
            raise ValueError(
                f"When declaring parameter {{{name}}} passing a descriptor with"
                "`dynamic_typing=True` is not allowed when the parameter type is provided"
            )
        descriptor.type = default.value
        return None
    if not descriptor.dynamic_typing:
        descriptor.type = Type.from_parameter_value(default).value
        if descriptor.type == Type.NOT_SET.value:
            raise ValueError(
                "Cannot declare a statically typed parameter with default value "
                "of type PARAMETER_NOT_SET"
            )
    return default
