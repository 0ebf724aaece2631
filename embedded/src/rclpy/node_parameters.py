"""The part of a node that has to do with parameters."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from rclpy.exceptions import ParameterNotDeclaredException
from rclpy.parameter import Parameter
from rclpy.parameter_store import _UNSET, ParameterStore


class NodeParameters:
    """Methods of `Node` on its parameters; the errors are those of `ParameterStore`."""

    _parameters: ParameterStore

    def declare_parameter(
        self, name: str, value: Any = None, descriptor: Any = None, ignore_override: bool = False
    ) -> Parameter:
        """Declares a parameter: the command line's value replaces the default."""
        return self._parameters.declare(name, value, descriptor, ignore_override)

    def declare_parameters(
        self, namespace: str, parameters: Sequence[tuple[Any, ...]], ignore_override: bool = False
    ) -> list[Parameter]:
        """Declares several: tuples of name, default and descriptor."""
        prefix = f"{namespace}." if namespace else ""
        declared = []
        for item in parameters:
            name, value, descriptor = (*item, None, None)[:3]
            declared.append(
                self.declare_parameter(prefix + name, value, descriptor, ignore_override)
            )
        return declared

    def undeclare_parameter(self, name: str) -> None:
        """Takes a declaration back."""
        if name not in self._parameters.parameters:
            raise ParameterNotDeclaredException(name)
        del self._parameters.parameters[name], self._parameters.descriptors[name]

    def has_parameter(self, name: str) -> bool:
        """Whether it has been declared."""
        return name in self._parameters.parameters

    def get_parameter(self, name: str) -> Parameter:
        """A parameter."""
        return self._parameters.get(name)

    def get_parameter_or(self, name: str, alternative_value: Any = _UNSET) -> Parameter:
        """A parameter, or the given one if there is none."""
        if name in self._parameters.parameters:
            return self._parameters.get(name)
        if isinstance(alternative_value, Parameter):
            return alternative_value
        return self._parameters.get(name, alternative_value)

    def get_parameters(self, names: Sequence[str]) -> list[Parameter]:
        """Several parameters."""
        return [self.get_parameter(name) for name in names]

    def get_parameters_by_prefix(self, prefix: str) -> dict[str, Parameter]:
        """Parameters whose names begin with a prefix and a dot, without that."""
        start = f"{prefix}." if prefix else ""
        found = self._parameters.parameters
        return {key.removeprefix(start): p for key, p in found.items() if key.startswith(start)}

    def describe_parameter(self, name: str) -> Any:
        """The descriptor of a parameter."""
        if name not in self._parameters.descriptors:
            raise ParameterNotDeclaredException(name)
        return self._parameters.descriptors[name]

    def set_parameters(self, parameter_list: Sequence[Parameter]) -> list[Any]:
        """Sets one after the other; returns a SetParametersResult for each."""
        return [self._parameters.set_atomically([parameter]) for parameter in parameter_list]

    def set_parameters_atomically(self, parameter_list: Sequence[Parameter]) -> Any:
        """Sets all or none; returns a SetParametersResult."""
        return self._parameters.set_atomically(parameter_list)

    def add_on_set_parameters_callback(self, callback: Callable[[list[Parameter]], Any]) -> None:
        """Has `callback` asked before parameters change; it returns a SetParametersResult."""
        self._parameters.callbacks.insert(0, callback)

    def remove_on_set_parameters_callback(self, callback: Callable[[list[Parameter]], Any]) -> None:
        """Forgets a callback."""
        self._parameters.callbacks.remove(callback)

    def add_post_set_parameters_callback(self, callback: Callable[[list[Parameter]], Any]) -> None:
        """Has `callback` told after parameters have changed."""
        self._parameters.post_callbacks.insert(0, callback)
