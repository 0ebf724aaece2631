"""Messages to bytes and back, as they are on the wire and in bags."""

from __future__ import annotations

from typing import Any

from rclpy.type_support import check_is_valid_msg_type


def serialize_message(message: Any) -> bytes:
    """Converts a message to a header of four bytes and CDR.

    Raises:
        AttributeError: The object is no message.
    """
    check_is_valid_msg_type(type(message))
    return bytes(message.serialize())


def deserialize_message(serialized_message: bytes, message_type: Any) -> Any:
    """Converts bytes to a message of a type.

    Raises:
        AttributeError: the type is none of a message.
        CdrError: the bytes end too early.
    """
    check_is_valid_msg_type(message_type)
    return message_type.deserialize(serialized_message)
