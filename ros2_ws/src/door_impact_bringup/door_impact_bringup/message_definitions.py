"""Definitions of messages for a recording: those of ROS 2 and those of any other package."""

from pathlib import Path
from typing import Any

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory
from rosbags.typesys import Stores, TypesysError, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from door_impact_bringup.errors import DefinitionError


class MessageDefinitions:
    """Jazzy's messages, which rosbags contains, and others, read from ``share/PACKAGE/msg``.

    Attributes:
        store: The definitions known until now; rosbags takes texts and type hashes (RIHS01) from
            it.
    """

    def __init__(self) -> None:
        self.store: Typestore = get_typestore(Stores.ROS2_JAZZY)

    def require(self, name: str) -> None:
        """Adds the definition of a message and of all messages that it contains.

        Args:
            name: Name of the message, ``package/msg/Name``.

        Raises:
            DefinitionError: No file defines the message, or the file cannot be understood.
        """
        found: dict[str, Any] = {}
        wanted = [name]
        while wanted:
            current = wanted.pop()
            if current in self.store.fielddefs or current in found:
                continue
            try:
                found.update(get_types_from_msg(_file(current).read_text("utf-8"), current))
            except (PackageNotFoundError, OSError, ValueError, TypesysError) as error:
                raise DefinitionError(current, str(error)) from error
            _, fields = found[current]
            wanted += [part for _, kind in fields for part in _references(kind)]
        self.store.register(found)


def _file(name: str) -> Path:
    package, kind, short = name.split("/")
    return Path(get_package_share_directory(package)) / kind / f"{short}.msg"


def _references(kind: Any) -> list[str]:
    """Lists the messages in the type of a field.

    Args:
        kind: Type as rosbags has it, (node, details); the details of an array are such a pair.
    """
    node, details = kind
    if node.name in ("ARRAY", "SEQUENCE"):
        return _references(details[0])
    return [details] if node.name == "NAME" else []
