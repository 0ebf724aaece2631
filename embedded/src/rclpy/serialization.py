"""Messages to bytes and back, as they are on the wire and in bags."""

from __future__ import annotations

from typing import Any

from rclpy.type_support import check_is_valid_msg_type


def serialize_message(message: Any) -> bytes:
    """A message in CDR, behind its header of four bytes.

    Raises:
        AttributeError: it is no message.
    """
    check_is_valid_msg_type(type(message))
    return bytes(message.serialize())


def deserialize_message(serialized_message: bytes, message_type: Any) -> Any:
    """The message of a type that bytes hold.

    Raises:
        AttributeError: the type is none of a message.
        CdrError: the bytes end too early.
    """
    check_is_valid_msg_type(message_type)
    return message_type.deserialize(serialized_message)
