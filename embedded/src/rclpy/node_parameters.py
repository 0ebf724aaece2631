"""The methods of a node for its parameters."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from ros2_embedded.messages import message_class

from rclpy.exceptions import ParameterNotDeclaredException
from rclpy.parameter import PARAMETER_SEPARATOR_STRING, Parameter
from rclpy.parameter_store import new_descriptor


class NodeParameters:
    """Methods of `Node` on its parameters; the errors are those of `ParameterStore`."""

    handle: Any

    def declare_parameter(
        self, name: str, value: Any = None, descriptor: Any = None, ignore_override: bool = False
    ) -> Parameter:
        """Declares a parameter: the command line's value replaces the default."""
        item: tuple[Any, ...] = (name,)
        if value is not None or descriptor is not None:
            item = (name, value, new_descriptor() if descriptor is None else descriptor)
        return self.declare_parameters("", [item], ignore_override)[0]

    def declare_parameters(
        self, namespace: str, parameters: Sequence[tuple[Any, ...]], ignore_override: bool = False
    ) -> list[Parameter]:
        """Declares several: tuples of name, default and descriptor."""
        return self.handle.parameters.declare(namespace, parameters, ignore_override)

    def undeclare_parameter(self, name: str) -> None:
        """Removes a declared parameter."""
        self.handle.parameters.undeclare(name)

    def has_parameter(self, name: str) -> bool:
        """Whether a parameter has been declared."""
        return name in self.handle.parameters.parameters

    def get_parameter(self, name: str) -> Parameter:
        """Returns a parameter."""
        return self.handle.parameters.get(name)

    def get_parameter_or(self, name: str, alternative_value: Parameter | None = None) -> Parameter:
        """Returns a parameter if it has a value, otherwise the alternative."""
        return self.handle.parameters.get_or(name, alternative_value)

    def get_parameters(self, names: Sequence[str]) -> list[Parameter]:
        """Returns several parameters."""
        _check_names(names)
        return [self.get_parameter(name) for name in names]

    def get_parameter_type(self, name: str) -> Any:
        """The number of a parameter's type."""
        if self.has_parameter(name):
            return self.handle.parameters.parameters[name].type_.value
        if self.handle.parameters.allow_undeclared:
            return Parameter.Type.NOT_SET
        raise ParameterNotDeclaredException(name)

    def get_parameter_types(self, names: Sequence[str]) -> list[Any]:
        """The numbers of several parameters' types."""
        _check_names(names)
        return [self.get_parameter_type(name) for name in names]

    def get_parameters_by_prefix(self, prefix: str) -> dict[str, Parameter]:
        """The parameters whose names begin with a prefix and a dot; the keys are without these."""
        start = prefix + PARAMETER_SEPARATOR_STRING if prefix else ""
        found = self.handle.parameters.parameters
        return {key.removeprefix(start): p for key, p in found.items() if key.startswith(start)}

    def list_parameters(self, prefixes: list[str], depth: int) -> Any:
        """Names of parameters as a ListParametersResult.

        Args:
            prefixes: Names and groups of parameters to list; an empty list means all.
            depth: Largest number of parts of a name after its prefix; 0 means any number.

        Raises:
            TypeError: An argument has another type.
            ValueError: The depth is negative.
        """
        if not isinstance(prefixes, list):
            raise TypeError("The prefixes argument must be a list")
        if not all(isinstance(prefix, str) for prefix in prefixes):
            raise TypeError("All prefixes must be instances of type str")
        if not isinstance(depth, int):
            raise TypeError("The depth must be instance of type int")
        if depth < 0:
            raise ValueError("The depth must be greater than or equal to zero")
        result = message_class("rcl_interfaces/msg/ListParametersResult")()
        names = [n for n in self.handle.parameters.parameters if _is_listed(n, prefixes, depth)]
        groups = [name.rpartition(PARAMETER_SEPARATOR_STRING)[0] for name in names]
        result.names, result.prefixes = names, [g for g in dict.fromkeys(groups) if g]
        return result

    def describe_parameter(self, name: str) -> Any:
        """The descriptor of a parameter."""
        return self.handle.parameters.describe(name)

    def describe_parameters(self, names: Sequence[str]) -> list[Any]:
        """The descriptors of several parameters."""
        return [self.describe_parameter(name) for name in names]

    def set_descriptor(self, name: str, descriptor: Any, alternative_value: Any = None) -> Any:
        """Sets a descriptor, and the alternative value if it forbids the present value."""
        return self.handle.parameters.set_descriptor(name, descriptor, alternative_value)

    def set_parameters(self, parameter_list: Sequence[Parameter]) -> list[Any]:
        """Sets one after the other; returns a SetParametersResult for each."""
        store = self.handle.parameters
        return [store.set_atomically([parameter]) for parameter in parameter_list]

    def set_parameters_atomically(self, parameter_list: Sequence[Parameter]) -> Any:
        """Sets all or none; returns a SetParametersResult."""
        return self.handle.parameters.set_atomically(parameter_list)

    def add_pre_set_parameters_callback(
        self, callback: Callable[[list[Parameter]], list[Parameter]]
    ) -> None:
        """Adds a callback that returns the parameters to set instead; the last one is first."""
        self.handle.parameters.pre_callbacks.insert(0, callback)

    def add_on_set_parameters_callback(self, callback: Callable[[list[Parameter]], Any]) -> None:
        """Adds a callback that may refuse changes; it returns a SetParametersResult."""
        self.handle.parameters.callbacks.insert(0, callback)

    def add_post_set_parameters_callback(self, callback: Callable[[list[Parameter]], None]) -> None:
        """Has `callback` called after parameters have changed."""
        self.handle.parameters.post_callbacks.insert(0, callback)

    def remove_pre_set_parameters_callback(
        self, callback: Callable[[list[Parameter]], list[Parameter]]
    ) -> None:
        """Removes a callback."""
        self.handle.parameters.pre_callbacks.remove(callback)

    def remove_on_set_parameters_callback(self, callback: Callable[[list[Parameter]], Any]) -> None:
        """Removes a callback."""
        self.handle.parameters.callbacks.remove(callback)

    def remove_post_set_parameters_callback(
        self, callback: Callable[[list[Parameter]], None]
    ) -> None:
        """Removes a callback."""
        self.handle.parameters.post_callbacks.remove(callback)


def _check_names(names: Sequence[str]) -> None:
    if not all(isinstance(name, str) for name in names):
        raise TypeError("All names must be instances of type str")


def _is_listed(name: str, prefixes: list[str], depth: int) -> bool:
    def short(text: str) -> bool:
        return not depth or text.count(PARAMETER_SEPARATOR_STRING) < depth

    if not prefixes:
        return short(name)
    for prefix in prefixes:
        start = prefix + PARAMETER_SEPARATOR_STRING
        if name == prefix or (name.startswith(start) and short(name.removeprefix(start))):
            return True
    return False
