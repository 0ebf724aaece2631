"""A client of the view's page in place of a browser."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable
from typing import Any

import msgspec
import numpy as np
import viser
import websockets.sync.client
import zstandard

_CAMERA: dict[str, Any] = {
    "type": "ViewerCameraMessage", "wxyz": (1.0, 0.0, 0.0, 0.0), "position": (2.0, 0.0, 1.0),
    "fov": 1.0, "near": 0.1, "far": 100.0, "image_height": 600, "image_width": 1000,
    "look_at": (0.0, 0.0, 0.0), "up_direction": (0.0, 0.0, 1.0)}
_HEAD = struct.Struct("<QQ")  # size of the messages, and of their compressed form
_ALIGNED = 8  # arrays, which follow the messages, begin at a multiple of so many bytes


class PageClient:
    """A connection as a browser's page has it.

    Args:
        port: Port of the page on this machine.

    Attributes:
        elements: Kind and properties of what is in the panels, by identifier.
        nodes: Messages that made the nodes of the scene, by name; later changes are in them.
        notifications: Title and text of each.
        camera: Place to which the page has moved the camera [m].
    """

    def __init__(self, port: int) -> None:
        self._socket = websockets.sync.client.connect(
            f"ws://127.0.0.1:{port}", max_size=None, compression=None,
            subprotocols=[f"viser-v{viser.__version__}"])  # type: ignore[list-item]
        self.elements: dict[str, dict[str, Any]] = {}
        self.nodes: dict[str, dict[str, Any]] = {}
        self.notifications: list[tuple[str, str]] = []
        self.camera = _CAMERA["position"]
        self._socket.send(msgspec.msgpack.encode(_CAMERA))

    def close(self) -> None:
        """End the connection."""
        self._socket.close()

    def read(self, timeout: float = 0.1) -> int:
        """Read what comes within a time [s]; return the number of messages."""
        try:
            data = self._socket.recv(timeout=timeout)
        except TimeoutError:
            return 0
        assert isinstance(data, bytes)
        size, packed = _HEAD.unpack_from(data)
        end = _HEAD.size + packed
        plain = msgspec.msgpack.decode(
            zstandard.decompress(data[_HEAD.size : end], max_output_size=size))
        arrays = []
        for length in plain["binaryBufferLengths"]:
            start = end + -end % _ALIGNED
            end = start + length
            arrays.append(data[start:end])
        for message in plain["messages"]:
            self._take(_with_arrays(message, arrays))
        return len(plain["messages"])

    def until(self, done: Callable[[], Any], limit: float = 60.0) -> None:
        """Read until a condition holds, for at most some time [s]."""
        end = time.monotonic() + limit
        while not done():
            assert time.monotonic() < end, "the page does not show what was waited for"
            self.read()

    def press(self, label: str) -> None:
        """Press a button."""
        self.enter(label, True)

    def enter(self, label: str, value: Any) -> None:
        """Enter a value into a button or an input that is there."""
        uuid = self._find(label)
        assert uuid is not None, f"nothing on the page is named {label}"
        self._socket.send(msgspec.msgpack.encode(
            {"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": value}}))

    def click(self, origin: tuple[float, ...], direction: tuple[float, ...]) -> None:
        """Click into the picture, where a ray begins at the camera [m]."""
        self._socket.send(msgspec.msgpack.encode({
            "type": "ScenePointerMessage", "event_type": "click", "ray_origin": origin,
            "ray_direction": direction, "screen_pos": ((0.5, 0.5),), "modifier": None}))

    def has(self, label: str) -> bool:
        """Whether there is a button or an input of this label."""
        return self._find(label) is not None

    def disabled(self, label: str) -> bool:
        """Whether a button that is there cannot be pressed."""
        return bool(self.elements[self._find(label) or ""]["disabled"])

    def text(self) -> str:
        """Return all texts of the panels."""
        return "\n".join(str(item["content"]) for item in self.elements.values()
                         if "content" in item)

    def _take(self, message: dict[str, Any]) -> None:
        kind = message["type"]
        if kind == "GuiUpdateMessage":
            self.elements.get(message["uuid"], {}).update(message["updates"])
        elif kind in ("NotificationShowMessage", "NotificationMessage"):
            props = message.get("props", message)
            self.notifications.append((props["title"], props["body"]))
        elif kind.startswith("Gui") and "uuid" in message and "props" in message:
            self.elements[message["uuid"]] = {"kind": kind, **message["props"]}
        elif kind == "SetCameraPositionMessage" and not message["initial"]:
            self.camera = message["position"]
        elif kind == "RemoveSceneNodeMessage":
            self.nodes.pop(message["name"], None)
        elif "name" in message:
            self.nodes.setdefault(message["name"], {}).update(
                {key: value for key, value in message.items() if key not in ("type", "name")})

    def _find(self, label: str) -> str | None:
        return next((uuid for uuid, item in self.elements.items()
                     if item.get("label") == label and item["kind"] != "GuiFolderMessage"), None)


def _with_arrays(part: Any, arrays: list[bytes]) -> Any:
    """Return a part of a message with its arrays, flat, in the places of their numbers."""
    if isinstance(part, list):
        return [_with_arrays(each, arrays) for each in part]
    if not isinstance(part, dict):
        return part
    if "__binary_index" in part:
        return np.frombuffer(arrays[part["__binary_index"]], dtype=part["dtype"])
    return {key: _with_arrays(value, arrays) for key, value in part.items()}
