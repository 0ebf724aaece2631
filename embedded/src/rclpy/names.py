"""ROS's rules for the names of nodes, namespaces, topics and services."""

from __future__ import annotations

import re
from typing import Literal

from ros2_embedded import naming

from rclpy.exceptions import (
    InvalidNamespaceException,
    InvalidNodeNameException,
    InvalidServiceNameException,
    InvalidTopicNameException,
)

Fault = tuple[str, int] | None
"""The error in a name, and the index of the first wrong character."""

_NODE_LENGTH, _TOPIC_LENGTH = 255, 255 - 8
_NAMESPACE_LENGTH = _TOPIC_LENGTH - 2


def _first(pattern: str, text: str) -> int | None:
    match = re.search(pattern, text, re.ASCII)
    return match.start() if match else None


def _node_name_fault(name: str) -> Fault:
    if not name:
        return "node name must not be empty", 0
    wrong = _first(r"\W", name)
    if wrong is not None:
        return "node name must not contain characters other than alphanumerics or '_'", wrong
    if name[0].isdigit():
        return "node name must not start with a number", 0
    if len(name) > _NODE_LENGTH:
        return f"node name length should not exceed '{_NODE_LENGTH}'", _NODE_LENGTH - 1
    return None


def _full_name_fault(name: str, kind: str, end: str = "") -> Fault:
    if not name:
        return f"{kind} must not be empty", 0
    if name[0] != "/":
        return f"{kind} must be absolute, it must lead with a '/'", 0
    if name.endswith("/"):
        return f"{kind} must not end with a '/'{end}", len(name) - 1
    wrong = _first(r"[^\w/]", name)
    if wrong is not None:
        return f"{kind} must not contain characters other than alphanumerics, '_', or '/'", wrong
    wrong = _first(r"(?<=/)[/\d]", name)
    if wrong is None:
        return None
    if name[wrong] == "/":
        return f"{kind} must not contain repeated '/'", wrong
    return f"{kind} must not have a token that starts with a number", wrong


def _namespace_fault(name: str) -> Fault:
    if name == "/":
        return None
    fault = _full_name_fault(name, "namespace", ", unless only a '/'")
    if fault is None and len(name) > _NAMESPACE_LENGTH:
        return f"namespace should not exceed '{_NAMESPACE_LENGTH}'", _NAMESPACE_LENGTH - 1
    return fault


def _full_topic_fault(name: str) -> Fault:
    fault = _full_name_fault(name, "topic name")
    if fault is None and len(name) > _TOPIC_LENGTH:
        return "topic length should not exceed '255U - 8U'", _TOPIC_LENGTH - 1
    return fault


def _brace_fault(name: str) -> Fault:
    """The error in the characters of a name that may have `{substitutions}`."""
    opened = -1
    substitution = "substitution name must not"
    unmatched = "topic name must not have unmatched (unbalanced) curly braces '{}'"
    for index, char in enumerate(name):
        if re.match(r"\w", char, re.ASCII):
            if opened >= 0 and index == opened + 1 and char.isdigit():
                return f"{substitution} start with a number", index
        elif char == "~":
            if index:
                return (
                    "topic name must not have tilde '~' unless it is the first character", index
                )  # fmt: skip
        elif char == "}":
            if opened < 0:
                return unmatched, index
            opened = -1
        elif opened >= 0:
            return f"{substitution} contain characters other than alphanumerics or '_'", index
        elif char == "{":
            opened = index
        elif char != "/":
            text = "contain characters other than alphanumerics, '_', '~', '{', or '}'"
            return f"topic name must not {text}", index
    return (unmatched, opened) if opened >= 0 else None


def _topic_fault(name: str) -> Fault:
    number = "topic name token must not start with a number"
    if not name:
        return "topic name must not be empty string", 0
    if name[0].isdigit():
        return number, 0
    if name.endswith("/"):
        return "topic name must not end with a forward slash", len(name) - 1
    fault = _brace_fault(name)
    if fault is not None:
        return fault
    if re.match(r"~[^/].", name):
        text = "have a tilde '~' that is not followed by a forward slash '/'"
        return f"topic name must not {text}", 1
    wrong = _first(r"(?<=/)\d", name)
    return None if wrong is None else (number, wrong)


def validate_node_name(node_name: str) -> Literal[True]:
    """Raises InvalidNodeNameException if the name is invalid."""
    fault = _node_name_fault(node_name)
    if fault:
        raise InvalidNodeNameException(node_name, *fault)
    return True


def validate_namespace(namespace: str) -> Literal[True]:
    """Raises InvalidNamespaceException if the namespace is invalid."""
    fault = _namespace_fault(namespace)
    if fault:
        raise InvalidNamespaceException(namespace, *fault)
    return True


def validate_topic_name(name: str, *, is_service: bool = False) -> Literal[True]:
    """Raises InvalidTopicNameException or InvalidServiceNameException if the name is invalid."""
    return _accept(name, _topic_fault(name), is_service)


def validate_full_topic_name(name: str, *, is_service: bool = False) -> Literal[True]:
    """Checks a name that must be absolute, with the errors of `validate_topic_name`."""
    return _accept(name, _full_topic_fault(name), is_service)


def _accept(name: str, fault: Fault, is_service: bool) -> Literal[True]:
    if fault:
        kind = InvalidServiceNameException if is_service else InvalidTopicNameException
        raise kind(name, *fault)
    return True


def expand_topic_name(topic_name: str, node_name: str, node_namespace: str) -> str:
    """Makes a name absolute: `~` is the node's full name, `{node}` and `{ns}` are its parts.

    Raises:
        ValueError: a name is not valid, or there is another substitution.
    """
    for kind, name, fault in (
        ("topic name", topic_name, _topic_fault(topic_name)),
        ("node name", node_name, _node_name_fault(node_name)),
        ("node namespace", node_namespace, _namespace_fault(node_namespace)),
    ):
        if fault:
            raise ValueError(f"{kind} '{name}' is invalid: {fault[0]}")
    full = topic_name
    if full.startswith("~"):
        full = naming.join(node_namespace, node_name) + full[1:]
    values = {"{node}": node_name, "{ns}": node_namespace, "{namespace}": node_namespace}
    for found in re.findall(r"\{\w*\}", full):
        if found not in values:
            raise ValueError(f"topic name '{topic_name}' is invalid: unknown substitution: {found}")
        full = full.replace(found, values[found])
    return full if full.startswith("/") else naming.join(node_namespace, full)
