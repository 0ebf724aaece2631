"""The ranges of values that a parameter's descriptor allows."""

from __future__ import annotations

import math
from typing import Any

from rclpy.parameter import Parameter

_TOLERANCE = 1e-6
"""Relative tolerance between floats."""


def refusal(parameter: Parameter, descriptor: Any, declared: bool, check_read_only: bool) -> str:
    """Why the descriptor refuses a parameter; empty if it does not."""
    kind = parameter.type_
    if check_read_only and descriptor.read_only:
        return f"Trying to set a read-only parameter: {parameter.name}."
    if not descriptor.dynamic_typing:
        if declared and kind is Parameter.Type.NOT_SET:
            return "Static parameter cannot be undeclared"
        if kind is not Parameter.Type.NOT_SET and kind.value != descriptor.type:
            expected = Parameter.Type(descriptor.type)
            return f"Wrong parameter type, expected '{expected}' got '{kind}'"
    if kind is Parameter.Type.INTEGER and descriptor.integer_range:
        return _outside_integers(parameter, descriptor.integer_range[0])
    if kind is Parameter.Type.DOUBLE and descriptor.floating_point_range:
        return _outside_floats(parameter, descriptor.floating_point_range[0])
    return ""


def _outside_integers(parameter: Parameter, limits: Any) -> str:
    low, high = sorted((limits.from_value, limits.to_value))
    name, value, step = parameter.name, parameter.value, limits.step
    if value in (low, high):
        return ""
    if not low < value < high:
        return f"Parameter {name} out of range. Min: {low}, Max: {high}, value: {value}"
    if step and (value - low) % step:
        return (
            f"The parameter value for {name} is not a valid step. "
            f"Min: {low}, max: {high}, value: {value}, step: {step}"
        )
    return ""


def _outside_floats(parameter: Parameter, limits: Any) -> str:
    low, high = sorted((limits.from_value, limits.to_value))
    name, value, step = parameter.name, parameter.value, limits.step
    if any(math.isclose(value, edge, rel_tol=_TOLERANCE) for edge in (low, high)):
        return ""
    if not low < value < high:
        return f"Parameter {name} out of range Min: {low}, Max: {high}, value: {value}"
    if step and not math.isclose(
        low + round((value - low) / step) * step, value, rel_tol=_TOLERANCE
    ):
        return (
            f"The parameter value for {name} is not close enough to a valid step. "
            f"Min: {low}, max: {high}, value: {value}, step: {step}"
        )
    return ""
