"""One message of a topic, for those who need no more."""

from __future__ import annotations

import math
import time
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile


def wait_for_message(
    msg_type: Any,
    node: Node,
    topic: str,
    *,
    qos_profile: QoSProfile | int = 1,
    time_to_wait: float = -1,
) -> tuple[bool, Any]:
    """Waits for the next message of a topic, whether or not an executor spins the node.

    Args:
        msg_type: type of the message.
        node: the node that listens.
        topic: name of the topic.
        qos_profile: of the subscription.
        time_to_wait: Timeout [s]; a negative one means no timeout.

    Returns:
        Whether a message was received, and the message or None.
    """
    context = node.context
    deadline = time.monotonic() + (time_to_wait if time_to_wait >= 0 else math.inf)
    wait_set = context.new_wait_set()
    context.wake_at_end(wait_set)
    messages: list[Any] = []

    def take(message: Any) -> None:  # in the thread that spins the node, if there is one
        messages.append(message)
        wait_set.wake()

    subscription = node.create_subscription(msg_type, topic, take, qos_profile)
    try:
        for source in subscription.sources:
            wait_set.add(source)
        while context.ok() and not messages and (left := deadline - time.monotonic()) > 0:
            wait_set.wait(left, lambda: messages or not context.ok())
            if taken := subscription.take():  # unless an executor was faster
                subscription.handle(*taken)
    finally:
        node.destroy_subscription(subscription)
        wait_set.close()
    return (True, messages[0]) if messages else (False, None)
