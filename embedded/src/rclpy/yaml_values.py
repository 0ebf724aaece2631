"""YAML as ROS 2 reads it in parameter files and in `-p name:=value`."""

from __future__ import annotations

import re
from typing import Any

import yaml

from rclpy.exceptions import RCLInvalidROSArgsError


class ArgumentError(RCLInvalidROSArgsError):
    """A ROS argument that cannot be understood."""


_PLAIN = "plain"


class _ParameterLoader(yaml.SafeLoader):
    """Marks the scalars that have neither quotes nor a tag."""

    def resolve(self, kind: Any, value: Any, implicit: Any) -> Any:
        if kind is yaml.ScalarNode and implicit[0]:
            return _PLAIN
        return super().resolve(kind, value, implicit)


_TRUE = ("Y", "y", "yes", "Yes", "YES", "true", "True", "TRUE", "on", "On", "ON")
_FALSE = ("N", "n", "no", "No", "NO", "false", "False", "FALSE", "off", "Off", "OFF")
_INTEGER = re.compile(r"[-+]?(0[xX][0-9a-fA-F]+|0[0-7]*|[1-9]\d*)")


def parameter_value(text: str) -> Any:
    """The value of a scalar without quotes: a bool, an int, a float, or the text itself."""
    if text in _TRUE or text in _FALSE:
        return text in _TRUE
    if _INTEGER.fullmatch(text):
        digits = text.lstrip("+-")
        octal = len(digits) > 1 and digits.isdigit() and digits[0] == "0"
        try:
            number = int(text, 8 if octal else 0)
            return number if -(1 << 63) <= number < 1 << 63 else float(number)
        except (OverflowError, ValueError):  # so many digits that no float holds it
            return text
    try:
        special = re.fullmatch(r"[-+]?\.(inf|Inf|INF|nan|NaN|NAN)", text)
        return text if "_" in text else float(text.replace(".", "") if special else text)
    except ValueError:
        return text


def load_parameters(text: str) -> Any:
    """Reads parameter values; rcl has its own, simpler rules for their types.

    Raises:
        ArgumentError: The text is no YAML, a value is missing, or a list mixes types.
    """
    try:
        root = yaml.compose(text, _ParameterLoader)
    except yaml.YAMLError as error:
        raise ArgumentError(f"not valid YAML: {error}") from error
    return None if root is None else _value(root)


def _value(node: Any) -> Any:
    if isinstance(node, yaml.MappingNode):
        tree: dict[str, Any] = {}
        for key, value in node.value:
            _merge(tree, str(key.value), _value(value))
        return tree
    if isinstance(node, yaml.SequenceNode):
        return _sequence(node)
    if node.tag != _PLAIN:
        return str(node.value)
    if not node.value:
        raise ArgumentError(f"No value at line {node.start_mark.line + 1}")
    return parameter_value(node.value)


def _merge(tree: dict[str, Any], key: str, value: Any) -> None:
    """Adds a value to a mapping. A key may be repeated: rcl then merges the mappings below it."""
    if isinstance(value, dict) and isinstance(old := tree.get(key), dict):
        for inner, inner_value in value.items():
            _merge(old, inner, inner_value)
    else:
        tree[key] = value


def _sequence(node: Any) -> Any:
    values = [_value(item) for item in node.value]
    kinds = {type(value) for value in values}
    if len(kinds) > 1 or kinds & {dict, list}:
        raise ArgumentError(f"Sequence should be of same type at line {node.start_mark.line + 1}")
    return values or None  # for rcl an empty list is a parameter that is not set
