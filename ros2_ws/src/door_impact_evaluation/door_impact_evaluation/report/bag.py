"""Reads what a replay shows from a recording: an MCAP file, or a folder of `ros2 bag record`.

Stamps are those of the messages; a message without one gets the time at which it was recorded. A
new run begins where the time goes back, because a simulation was reset.
"""

import math
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.files import shown
from door_model.recording.mcap import open_bag

from door_impact_evaluation.errors import RecordingError

JOINTS, DOOR = "/joint_states", "/door_angle"
_RESET = 1.0  # a step back in time that is longer than this is a reset [s]
_DESCRIPTIONS = {"/robot_description": "robot", "/door_description": "door"}
_POINTS = ("/zmp", "/com")
_WRENCH = "geometry_msgs/msg/WrenchStamped"
_TYPES = {
    JOINTS: "sensor_msgs/msg/JointState", DOOR: "sensor_msgs/msg/JointState",
    "/robot_description": "std_msgs/msg/String", "/door_description": "std_msgs/msg/String",
    "/tf": "tf2_msgs/msg/TFMessage", "/tf_static": "tf2_msgs/msg/TFMessage",
    "/zmp": "geometry_msgs/msg/PointStamped", "/com": "geometry_msgs/msg/PointStamped",
    "/support_polygon": "geometry_msgs/msg/PolygonStamped",
    "/joint_trajectory": "trajectory_msgs/msg/JointTrajectory",
    "/door_impact_plan": "door_impact_msgs/msg/ImpactPlan",
    "/hit_report": "door_impact_msgs/msg/HitReport",
}
_OWN_TIME = ("/door_impact_plan", "/tf_static", "/joint_trajectory", "/hit_report")
"""Topics whose stamps need not be of the moment at which they are published."""


@dataclass(frozen=True)
class Series:
    """Samples over time: `t` (n,) [s], increasing, and `values` (n, k)."""

    t: Array
    values: Array


@dataclass(frozen=True)
class Angles:
    """Joint angles of one publisher.

    Attributes:
        names: Names of the joints, J of them.
        positions: Their positions, (n, J) [rad] or [m].
        velocity: Their velocities, (n, J), or None where they were not published.
    """

    names: tuple[str, ...]
    positions: Series
    velocity: Series | None


@dataclass(frozen=True)
class Bag:
    """What was recorded of a run; everything may be missing.

    Attributes:
        descriptions: URDFs, by ``robot`` and ``door``.
        joints: Angles of the robot's joints, those of the most frequent publisher first.
        door: Angle of the door.
        poses: Poses of frames in their parents by the frame's name: place, quaternion w, x, y, z.
        points: Places by topic, ``/zmp`` and ``/com``.
        polygons: Stamps and corners (K, 2) of the support polygons [m].
        wrenches: Forces by topic, (n, 3) [N].
        plans: Messages ImpactPlan, with the times at which they were recorded [s]; minus infinity
            for the last one of before the run.
        trajectories: Messages JointTrajectory, with their starts [s].
        reports: Messages HitReport, with their stamps [s].
    """

    descriptions: dict[str, str] = field(default_factory=dict)
    joints: list[Angles] = field(default_factory=list)
    door: Angles | None = None
    poses: dict[str, Series] = field(default_factory=dict)
    points: dict[str, Series] = field(default_factory=dict)
    polygons: list[tuple[float, Array]] = field(default_factory=list)
    wrenches: dict[str, Series] = field(default_factory=dict)
    plans: list[tuple[float, Any]] = field(default_factory=list)
    trajectories: list[tuple[float, Any]] = field(default_factory=list)
    reports: list[tuple[float, Any]] = field(default_factory=list)


def read_runs(path: Path) -> list[Bag]:
    """Reads a recording.

    Args:
        path: An MCAP file, or a folder that `ros2 bag record` has made.

    Returns:
        What was recorded between two resets of the simulation, in order; those parts that have
        neither joint angles nor the angle of a door are left out.

    Raises:
        BadRecordingError: The file cannot be read.
        RecordingError: It contains neither joint angles nor the angle of a door.
    """
    with open_bag(path) as reader:
        found = _Messages()
        for topic, kind, received, message in _messages(reader):
            found.add(topic, kind, received, message)
        topics = sorted({connection.topic for connection in reader.connections
                         if connection.msgcount})
    runs = [bag for bag in found.bags() if bag.joints or bag.door is not None]
    if not runs:
        raise RecordingError(
            f"{shown(path)}: has no messages on {JOINTS} or {DOOR}; topics with messages: "
            f"{', '.join(topics) or 'none'}", value=topics, limit=(JOINTS, DOOR))
    return runs


def _messages(bag: Any) -> Iterator[tuple[str, str, float, Any]]:
    """Yields topic, type, time of recording [s] and message, in the order of the file.

    A topic whose type is not the expected one is left out.
    """
    for reader in bag.readers:
        wanted = [connection for connection in reader.connections if _TYPES.get(
            connection.topic, _WRENCH) == connection.msgtype]
        # rosbags sorts by time, which after a reset of the simulation mixes two runs.
        scan = getattr(reader.storage, "messages_scan", reader.messages)
        for connection, received, data in scan(wanted):
            message = bag.deserialize(data, connection.msgtype)
            yield connection.topic, connection.msgtype, 1e-9 * received, message


_Rows = dict[str, list[tuple[float, Any]]]


class _Messages:
    """Sorts messages by runs and by what they are."""

    def __init__(self) -> None:
        self._descriptions: dict[str, str] = {}
        self._runs: list[_Rows] = [defaultdict(list)]
        self._clock = DOOR  # topic whose stamps tell the time: that of the joints if there is one
        self._now = -math.inf  # its last stamp [s]
        self._wrenches: set[str] = set()

    def add(self, topic: str, kind: str, received: float, message: Any) -> None:
        if topic in _DESCRIPTIONS:
            self._descriptions[_DESCRIPTIONS[topic]] = message.data
            return
        if topic in ("/tf", "/tf_static"):
            for transform in message.transforms:
                self._keep(topic, _stamp(transform, received), transform)
            return
        if kind == _WRENCH:
            self._wrenches.add(topic)
        stamp = received if topic == "/door_impact_plan" else _stamp(message, received)
        if topic == JOINTS:
            self._clock = JOINTS
        if topic == self._clock:
            if stamp < self._now - _RESET:
                self._begin_run()
            self._now = stamp
        self._keep(topic, stamp, message)

    def _begin_run(self) -> None:
        last = self._runs[-1]
        plans = [(-math.inf, plan) for _, plan in last["/door_impact_plan"][-1:]]
        self._runs.append(defaultdict(list, {
            "/door_impact_plan": plans, "/tf_static": list(last["/tf_static"])}))

    def _keep(self, topic: str, stamp: float, message: Any) -> None:
        # A message of before the reset may come a little after it.
        late = topic not in _OWN_TIME and len(self._runs) > 1 and stamp > self._now + _RESET
        self._runs[-2 if late else -1][topic].append((stamp, message))

    def bags(self) -> list[Bag]:
        """Returns what was found in each run."""
        return [self._bag(run) for run in self._runs]

    def _bag(self, rows: _Rows) -> Bag:
        poses: dict[str, list[tuple[float, Any]]] = defaultdict(list)
        for stamp, transform in (*rows["/tf_static"], *rows["/tf"]):
            poses[transform.child_frame_id].append((stamp, transform.transform))
        doors = _angles(rows[DOOR])
        return Bag(
            descriptions=self._descriptions,
            joints=_angles(rows[JOINTS]),
            door=doors[0] if doors else None,
            poses=_known({name: _series(found, _pose) for name, found in poses.items()}),
            points=_known({topic: _series(rows[topic], lambda m: _xyz(m.point))
                           for topic in _POINTS}),
            polygons=[(t, np.array([[p.x, p.y] for p in message.polygon.points]))
                      for t, message in rows["/support_polygon"]
                      if len(message.polygon.points) >= 3],
            wrenches=_known({topic: _series(rows[topic], lambda m: _xyz(m.wrench.force))
                             for topic in sorted(self._wrenches)}),
            plans=rows["/door_impact_plan"],
            trajectories=rows["/joint_trajectory"],
            reports=rows["/hit_report"],
        )


def _stamp(message: Any, received: float) -> float:
    stamp = message.header.stamp
    return float(stamp.sec + 1e-9 * stamp.nanosec) or received


def _xyz(point: Any) -> tuple[float, float, float]:
    return point.x, point.y, point.z


def _pose(transform: Any) -> tuple[float, ...]:
    turn = transform.rotation
    return (*_xyz(transform.translation), turn.w, turn.x, turn.y, turn.z)


def _series(rows: list[tuple[float, Any]], values: Callable[[Any], Any]) -> Series:
    """Sorts samples by their stamps; of two with the same stamp the first one stays.

    Samples that are no finite numbers are left out.
    """
    if not rows:
        return Series(np.empty(0), np.empty((0, 1)))
    t, index = np.unique(np.array([stamp for stamp, _ in rows]), return_index=True)
    found = np.array([values(rows[i][1]) for i in index], dtype=np.float64).reshape(len(t), -1)
    finite = np.isfinite(found).all(axis=1)
    return Series(t[finite], found[finite])


def _known(series: dict[str, Series]) -> dict[str, Series]:
    return {name: each for name, each in series.items() if each.t.size}


def _angles(rows: list[tuple[float, Any]]) -> list[Angles]:
    """Sorts joint states by their publishers, which name different joints."""
    groups: dict[tuple[str, ...], list[tuple[float, Any]]] = defaultdict(list)
    for stamp, message in rows:
        if message.name and len(message.position) == len(message.name):
            groups[tuple(message.name)].append((stamp, message))
    found = []
    for names, group in sorted(groups.items(), key=lambda item: -len(item[1])):
        positions = _series(group, lambda m: m.position)
        moving = all(len(message.velocity) == len(names) for _, message in group)
        velocity = _series(group if moving else [], lambda m: m.velocity)
        if positions.t.size:
            found.append(Angles(names, positions, velocity if velocity.t.size else None))
    return found
