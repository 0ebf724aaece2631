"""Errors of rclpy."""

from __future__ import annotations

from typing import Any

from ros2_embedded.naming import InvalidNameError


class RCLError(RuntimeError):
    """An operation that the state of the context or of an entity does not allow."""


class InvalidHandle(RuntimeError):
    """Something that has been destroyed was used."""


class NotInitializedException(Exception):
    """`rclpy.init()` has not been called, or `shutdown()` has."""

    def __init__(self) -> None:
        """Says what to do."""
        super().__init__("rclpy.init() has not been called")


class ParameterException(Exception):
    """Base of the parameter errors; `parameter` is the name."""

    def __init__(self, text: str, parameter: str) -> None:
        """Keeps the name of the parameter."""
        super().__init__(f"{text}: {parameter}")
        self.parameter = parameter


class ParameterNotDeclaredException(ParameterException):
    """The node has no such parameter."""

    def __init__(self, parameter: str) -> None:
        """Names the parameter."""
        super().__init__("Invalid access to undeclared parameter(s)", parameter)


class ParameterAlreadyDeclaredException(ParameterException):
    """The parameter has been declared before."""

    def __init__(self, parameter: str) -> None:
        """Names the parameter."""
        super().__init__("Parameter(s) already declared", parameter)


class ParameterUninitializedException(ParameterException):
    """The parameter has a type but no value yet."""

    def __init__(self, parameter: str) -> None:
        """Names the parameter."""
        super().__init__("The parameter is not initialized", parameter)


class InvalidParameterTypeException(ParameterException):
    """A value of another type than the parameter's."""

    def __init__(self, parameter: Any, expected: str) -> None:
        """Names the parameter, its type and the value's type."""
        Exception.__init__(
            self,
            f"Trying to set parameter '{parameter.name}' to '{parameter.value}' of type "
            f"'{parameter.type_.name}', expecting type '{expected}'",
        )
        self.parameter = parameter.name


class InvalidParameterValueException(ParameterException):
    """A value that a range or a callback of the node refuses."""

    def __init__(self, parameter: str, value: Any, reason: str) -> None:
        """Names the parameter, the value and the reason."""
        Exception.__init__(
            self, f"Invalid parameter value ({value}) for parameter '{parameter}': {reason}"
        )
        self.parameter, self.value = parameter, value


class ROSInterruptException(Exception):
    """An operation was cut short by the shutdown."""


InvalidNodeNameException = InvalidNameError
InvalidNamespaceException = InvalidNameError
InvalidTopicNameException = InvalidNameError
InvalidServiceNameException = InvalidNameError

__all__ = [
    "InvalidHandle",
    "InvalidNamespaceException",
    "InvalidNodeNameException",
    "InvalidParameterTypeException",
    "InvalidParameterValueException",
    "InvalidServiceNameException",
    "InvalidTopicNameException",
    "NotInitializedException",
    "ParameterAlreadyDeclaredException",
    "ParameterException",
    "ParameterNotDeclaredException",
    "ParameterUninitializedException",
    "RCLError",
    "ROSInterruptException",
]
