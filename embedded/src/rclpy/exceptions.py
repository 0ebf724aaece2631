"""Errors of rclpy."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

Names = str | Sequence[str]


class RCLError(RuntimeError):
    """An operation that the state of the context or of an entity does not allow."""


class RCLInvalidROSArgsError(RCLError):
    """ROS arguments of a node that cannot be understood."""


class UnknownROSArgsError(RuntimeError):
    """Arguments after `--ros-args` that ROS does not know."""


class NodeNameNonExistentError(RCLError):
    """A node that was asked about is not in the graph."""


class UnsupportedEventTypeError(RCLError):
    """The middleware does not report this event."""


class InvalidHandle(RuntimeError):
    """Something that has been destroyed was used."""


class NotInitializedException(Exception):
    """`rclpy.init()` has not been called, or `shutdown()` has."""

    def __init__(self, message: str | None = None) -> None:
        """Says what to do, and what was tried."""
        text = "rclpy.init() has not been called."
        super().__init__(f"{text} msg:{message}" if message else text)


class NameValidationException(Exception):
    """A name that ROS does not allow; the text points at the first wrong character."""

    def __init__(self, name_type: str, name: str, error_msg: str, invalid_index: int) -> None:
        """Shows the name with a mark below the character at `invalid_index`."""
        mark = " " * invalid_index + "^"
        super().__init__(f"Invalid {name_type}: {error_msg}:\n  '{name}'\n   {mark}")


class InvalidNamespaceException(NameValidationException):
    """A namespace that ROS does not allow."""

    def __init__(self, name: str, error_msg: str, invalid_index: int) -> None:
        """Names the namespace."""
        super().__init__("namespace", name, error_msg, invalid_index)


class InvalidNodeNameException(NameValidationException):
    """A node's name that ROS does not allow."""

    def __init__(self, name: str, error_msg: str, invalid_index: int) -> None:
        """Names the node."""
        super().__init__("node name", name, error_msg, invalid_index)


class InvalidTopicNameException(NameValidationException):
    """A topic's name that ROS does not allow."""

    def __init__(self, name: str, error_msg: str, invalid_index: int) -> None:
        """Names the topic."""
        super().__init__("topic name", name, error_msg, invalid_index)


class InvalidServiceNameException(NameValidationException):
    """A service's name that ROS does not allow."""

    def __init__(self, name: str, error_msg: str, invalid_index: int) -> None:
        """Names the service."""
        super().__init__("service name", name, error_msg, invalid_index)


class ParameterException(Exception):
    """Base of the parameter errors."""

    def __init__(self, error_msg: str, parameters: Names) -> None:
        """Names the parameter or the parameters."""
        super().__init__(f"{error_msg}: {parameters}")


class ParameterNotDeclaredException(ParameterException):
    """The node has no such parameter."""

    def __init__(self, parameters: Names) -> None:
        """Names the parameters."""
        super().__init__("Invalid access to undeclared parameter(s)", parameters)


class ParameterAlreadyDeclaredException(ParameterException):
    """The parameter has been declared before."""

    def __init__(self, parameters: Names) -> None:
        """Names the parameters."""
        super().__init__("Parameter(s) already declared", parameters)


class InvalidParameterException(ParameterException):
    """A name that no parameter can have."""

    def __init__(self, parameter_name: str) -> None:
        """Names the parameter."""
        super().__init__("Invalid parameter name", parameter_name)


class InvalidParameterTypeException(ParameterException):
    """A value of another type than the parameter's."""

    def __init__(self, desired_parameter: Any, expected_type: str) -> None:
        """Names the parameter, its type and the value's type."""
        super().__init__(
            f"Trying to set parameter '{desired_parameter.name}' to '{desired_parameter.value}' "
            f"of type '{desired_parameter.type_.name}', expecting type '{expected_type}'",
            desired_parameter.name,
        )


class InvalidParameterValueException(ParameterException):
    """A value that a range or a callback of the node refuses."""

    def __init__(self, parameter: str, value: Any, reason: str) -> None:
        """Names the parameter, the value and the reason."""
        text = f"Invalid parameter value ({value}) for parameter. Reason: {reason}"
        super().__init__(text, parameter)


class ParameterImmutableException(ParameterException):
    """The parameter is read-only."""

    def __init__(self, parameter_name: str) -> None:
        """Names the parameter."""
        super().__init__("Attempted to modify read-only parameter", parameter_name)


class ParameterUninitializedException(ParameterException):
    """The parameter has a type but no value yet."""

    def __init__(self, parameter_name: str) -> None:
        """Names the parameter."""
        super().__init__(f"The parameter '{parameter_name}' is not initialized", parameter_name)


class ROSInterruptException(Exception):
    """An operation was cut short by the shutdown."""

    def __init__(self) -> None:
        """Says why."""
        super().__init__("rclpy.shutdown() has been called")
