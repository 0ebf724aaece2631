"""Definitions of messages as a recording carries them: ROS 2's own, and those of other packages."""

from pathlib import Path
from typing import Any

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory
from rosbags.typesys import Stores, TypesysError, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from door_impact_bringup.errors import BringupError


class DefinitionError(BringupError):
    """There is no definition of a message.

    Attributes:
        name: Of the message.
    """

    def __init__(self, name: str, why: str) -> None:
        super().__init__(f"no definition of {name}: {why}")
        self.name = name


class MessageDefinitions:
    """Messages of Jazzy as rosbags has them, and any other from ``share/PACKAGE/msg``.

    Attributes:
        store: What is known so far; rosbags takes texts and type hashes (RIHS01) from it.
    """

    def __init__(self) -> None:
        self.store: Typestore = get_typestore(Stores.ROS2_JAZZY)

    def require(self, name: str) -> None:
        """Makes a message known, with all that it refers to.

        Args:
            name: ``package/msg/Name``.

        Raises:
            DefinitionError: There is no file that defines it, or it makes no sense.
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
    """The messages in a field's type: (node, details), where rows nest another such pair."""
    node, details = kind
    if node.name in ("ARRAY", "SEQUENCE"):
        return _references(details[0])
    return [details] if node.name == "NAME" else []
