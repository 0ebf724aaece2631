"""Conversion of the messages of zmp_publisher."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from door_impact_common.arrays import Array
from geometry_msgs.msg import Point, Point32, PointStamped, PolygonStamped, TransformStamped
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from zmp_publisher.zmp_estimator import ZmpReading

_DIAMETER = 0.04  # diameter of the markers [m]
# Red, green and blue of the markers, from 0 to 1.
_COLORS = {"zmp": (0.9, 0.1, 0.1), "com": (0.1, 0.4, 0.9)}


def point(stamp: Any, frame: str, place: Iterable[float]) -> PointStamped:
    """Make the message of a point, (2,) on the floor or (3,) [m], in a frame."""
    message = PointStamped(point=_point(place))
    message.header.stamp, message.header.frame_id = stamp, frame
    return message


def polygon(stamp: Any, frame: str, corners: Array) -> PolygonStamped:
    """Make the message of a polygon (M, 2) [m] on the floor of a frame."""
    message = PolygonStamped()
    message.header.stamp, message.header.frame_id = stamp, frame
    message.polygon.points = [Point32(x=x, y=y) for x, y in corners.tolist()]
    return message


def transforms(stamp: Any, frames: Iterable[tuple[str, str]], rows: Iterable[Any]) -> TFMessage:
    """Make the message of transforms.

    Args:
        stamp: Stamp of all transforms.
        frames: Names (parent, child) of the frames of each transform.
        rows: Position x, y, z [m] and quaternion x, y, z, w of each child in its parent, (7,) each.
    """
    message = TFMessage()
    message.transforms = [
        TransformStamped(header=Header(frame_id=parent), child_frame_id=child)
        for parent, child in frames]
    move(message, stamp, rows)
    return message


def move(message: TFMessage, stamp: Any, rows: Iterable[Any]) -> None:
    """Give the transforms of a message another stamp and other rows, as `transforms` has them."""
    for one, (x, y, z, qx, qy, qz, qw) in zip(
            message.transforms, np.array(list(rows), dtype=float).tolist(), strict=True):
        to, turn = one.transform.translation, one.transform.rotation
        one.header.stamp, to.x, to.y, to.z = stamp, x, y, z
        turn.x, turn.y, turn.z, turn.w = qx, qy, qz, qw


def markers(stamp: Any, frame: str, places: Mapping[str, Iterable[float] | None]) -> MarkerArray:
    """Make the message of balls at the positions of ``zmp`` and ``com`` [m] in a frame.

    A ball whose position is None is deleted. Balls are needed because Foxglove does not draw
    PointStamped.
    """
    message = MarkerArray()
    message.markers = [_marker(stamp, frame, name, place) for name, place in places.items()]
    return message


def diagnostics(
    stamp: Any, robot: str, state: tuple[bytes, str], values: Mapping[str, str]
) -> DiagnosticArray:
    """Make the diagnostics of a robot from a state (level and text) and further values."""
    level, text = state
    message = DiagnosticArray(status=[DiagnosticStatus(
        name="zmp_publisher: ZMP", hardware_id=robot, level=level, message=text,
        values=[KeyValue(key=key, value=value) for key, value in values.items()])])
    message.header.stamp = stamp
    return message


def reading_values(reading: ZmpReading) -> dict[str, str]:
    """Format a reading for diagnostics: force in N, lengths in m or in the unit of the key."""
    return {
        "margin_mm": f"{reading.margin * 1e3:.1f}",
        "zmp": f"{reading.point[0]:.4f} {reading.point[1]:.4f}",
        "support": "+".join(reading.soles),
        "polygon": "; ".join(f"{x:.4f} {y:.4f}" for x, y in reading.polygon),
        "normal_force": f"{reading.normal_force:.1f}",
    }


def _point(place: Iterable[float]) -> Point:
    return Point(**{axis: float(value) for axis, value in zip("xyz", place, strict=False)})


def _marker(stamp: Any, frame: str, name: str, place: Iterable[float] | None) -> Marker:
    message = Marker()
    message.header.stamp, message.header.frame_id = stamp, frame
    message.ns = name
    if place is None:
        message.action = Marker.DELETE
        return message
    message.type, message.action = Marker.SPHERE, Marker.ADD
    message.pose.position = _point(place)
    message.scale.x = message.scale.y = message.scale.z = _DIAMETER
    message.color.r, message.color.g, message.color.b = _COLORS[name]
    message.color.a = 1.0
    return message
