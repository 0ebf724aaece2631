"""The type of the messages on a topic."""

from __future__ import annotations

import time
from typing import Any

from rclpy.exceptions import NameValidationException
from rclpy.node import Node

from ros2_embedded.cli import interfaces
from ros2_embedded.cli.common import CliError

_POLL = 0.1


def message_type(name: str) -> Any:
    """The class of the message type that the user has named.

    Raises:
        CliError: There is no such type.
    """
    return interfaces.find(name, "msg", "The passed message type is invalid")


def type_of_topic(node: Node, topic: str, *, wait: bool) -> Any:
    """Class of a topic's messages, or None if there is no such topic.

    Args:
        node: looks at the graph.
        topic: any form of its name.
        wait: whether to wait for the topic.

    Raises:
        CliError: the topic's name is not valid, or it has several types, or an unknown one.
        RCLError: A signal ends the command while it waits.
    """
    try:
        name = node.resolve_topic_name(topic)
    except NameValidationException as error:
        raise CliError(str(error)) from error
    types = _types(node, name)
    if not types:
        print(f"WARNING: topic [{topic}] does not appear to be published yet", flush=True)
    while wait and not types:
        time.sleep(_POLL)
        types = _types(node, name)
    if not types:
        return None
    if len(types) > 1:
        raise CliError(
            f"Cannot echo topic '{topic}', as it contains more than one type: [{', '.join(types)}]"
        )
    return interfaces.find(types[0], "msg", f"The message type '{types[0]}' is invalid")


def _types(node: Node, name: str) -> list[str]:
    return dict(node.get_topic_names_and_types()).get(name, [])
