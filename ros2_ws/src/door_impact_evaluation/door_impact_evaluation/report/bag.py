"""Read runs from a recording: an MCAP file, or a folder of `ros2 bag record`.

Stamps are those of the messages; a message without one gets the time at which it was recorded. A
new run begins where the time goes back by more than 1 s, because a simulation was reset.
"""

import math
import os
import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.files import shown
from door_impact_view.replay.recording import Curve, Plot
from door_impact_view.scene import colors
from door_impact_view.scene.urdf import read_urdf
from door_model.recording.mcap import Bag, open_bag
from hrp2_description.support import DegeneratePolygonError, polygon_margin, support_polygon

from door_impact_evaluation.errors import RecordingError
from door_impact_evaluation.report.recorded_run import (
    Body,
    RecordedRun,
    Series,
    events_of,
    padded,
    phases_of,
)
from door_impact_evaluation.report.replay import LONGEST

_SAME = 1e-6      # largest difference of the joint angles of a knot and its copy [rad]
_MOVED = 0.005    # angle by which a door that is hit has moved [rad]
_LONGEST = 10.0   # time after the start of the run-up in which a contact is looked for [s]
_RUN_UP = "cam"


@dataclass(frozen=True)
class Hit:
    """An executed plan.

    Attributes:
        plan: Message ImpactPlan.
        starts: Start [s] and name of each phase that was begun, in order.
        end: Time at which the motion had ended [s].
        contact: Time of the contact [s]; None without one.
        peak: Time of the door's largest angle after it [s]; None without one.
    """

    plan: Any
    starts: list[tuple[float, str]]
    end: float
    contact: float | None
    peak: float | None


def find_hits(plans: Sequence[tuple[float, Any]], trajectories: Sequence[tuple[float, Any]],
              door: Series | None) -> list[Hit]:
    """Find the plans that were executed, in the order of their starts.

    Args:
        plans: Messages ImpactPlan, with the times at which they were recorded [s].
        trajectories: Messages JointTrajectory, with their starts [s].
        door: Angle of the door (n, 1) [rad].
    """
    sent = sorted(trajectories, key=lambda row: row[0])
    begun = []
    for number, (start, trajectory) in enumerate(sent):
        known = [plan for received, plan in plans if received <= start]
        starts = _phase_starts(known[-1], start, trajectory) if known else []
        if starts:
            begun.append((number, known[-1], starts))
    following = [number for number, _, _ in begun[1:]] + [len(sent)]
    hits = []
    for (_, plan, starts), last in zip(begun, following, strict=False):
        start, trajectory = sent[last - 1]
        rest = trajectory.points[-1].time_from_start if trajectory.points else None
        end = start + (_seconds(rest) if rest is not None else 0.0)
        contact, peak = (None, None) if door is None else _opening(door, starts[-1][0], end)
        after = ((contact, "post"), (peak, plan.phases[-1].name))
        hits.append(Hit(plan, starts + [(time, name) for time, name in after if time is not None],
                        end, contact, peak))
    return hits


def _phase_starts(plan: Any, start: float, trajectory: Any) -> list[tuple[float, str]]:
    """Return the starts of the phases up to the contact, if a trajectory is that of a plan."""
    column = {name: index for index, name in enumerate(trajectory.joint_names)}
    knots = np.array([point.positions for point in trajectory.points])
    found: list[tuple[float, str]] = []
    first = 0  # knot from which on the next phase is looked for
    for phase in plan.phases:
        planned = phase.trajectory
        if not len(knots) or not planned.points or not set(planned.joint_names) <= set(column):
            return []
        wanted = np.array(planned.points[0].positions)
        rows = knots[first:, [column[name] for name in planned.joint_names]]
        same = np.flatnonzero(np.abs(rows - wanted).max(axis=1) < _SAME)
        if not same.size:
            return []
        first += int(same[0])
        found.append((start + _seconds(trajectory.points[first].time_from_start), phase.name))
        if phase.name == _RUN_UP:
            return found
    return []


def _opening(door: Series, begin: float, end: float) -> tuple[float | None, float | None]:
    """Find when a door that stood at `begin` starts to open, and its first largest angle [s]."""
    rows = np.flatnonzero((door.t >= begin) & (door.t <= end))
    t, angle = door.t[rows], door.values[rows, 0]
    moved = np.flatnonzero((angle > angle[:1] + _MOVED) & (t < begin + _LONGEST))
    if not moved.size:
        return None, None
    first = max(int(moved[0]) - 1, 0)
    fallen = np.flatnonzero(np.maximum.accumulate(angle) - angle > _MOVED)
    fallen = fallen[fallen > first]
    top = angle[first:fallen[0]] if fallen.size else angle[first:]
    return float(t[first]), float(t[first + int(np.argmax(top))])


def _seconds(duration: Any) -> float:
    return float(duration.sec + 1e-9 * duration.nanosec)


_JOINTS, _DOOR = "/joint_states", "/door_angle"
_ROBOT_URDF, _DOOR_URDF = "/robot_description", "/door_description"
_PLAN, _TRAJECTORY, _STATIC = "/door_impact_plan", "/joint_trajectory", "/tf_static"
_ZMP, _COM, _SUPPORT = "/zmp", "/com", "/support_polygon"
_TYPES = {
    _JOINTS: "sensor_msgs/msg/JointState", _DOOR: "sensor_msgs/msg/JointState",
    _ROBOT_URDF: "std_msgs/msg/String", _DOOR_URDF: "std_msgs/msg/String",
    "/tf": "tf2_msgs/msg/TFMessage", _STATIC: "tf2_msgs/msg/TFMessage",
    _ZMP: "geometry_msgs/msg/PointStamped", _COM: "geometry_msgs/msg/PointStamped",
    _SUPPORT: "geometry_msgs/msg/PolygonStamped",
    _TRAJECTORY: "trajectory_msgs/msg/JointTrajectory", _PLAN: "door_impact_msgs/msg/ImpactPlan",
}
_WRENCH = "geometry_msgs/msg/WrenchStamped"  # on whatever topic
_LATCHED = (_ROBOT_URDF, _DOOR_URDF, _STATIC, _PLAN)  # what was said before a reset still holds
_RESET = 1.0  # a step back in time that is longer than this is a reset [s]
_NAMED = 6  # joints that a sentence names at most
_MOST_RUNS = 200  # a recording with more resets has messages of several clocks
_MAGIC = b"\x89MCAP0\r\n"  # begin and end of every complete MCAP file
_COLORS = (colors.COM, colors.FORCE, colors.CAPTURE_POINT, colors.DOOR)  # of the forces

_Rows = list[tuple[float, Any]]  # messages with their stamps [s]


def read_runs(path: Path) -> list[RecordedRun]:
    """Read a recording.

    Args:
        path: An MCAP file, or a folder that `ros2 bag record` has made; `metadata.yaml` is not
            needed.

    Returns:
        What was recorded between two resets of the simulation, in order; those parts that have
        neither joint angles nor the angle of a door are left out.

    Raises:
        BadRecordingError: The file cannot be read.
        RecordingError: It contains neither joint angles nor the angle of a door, or more than
            `_MOST_RUNS` resets.
        UrdfError: The description of the robot or of the door cannot be read.
    """
    with open_bag(path) as bag:
        parts = _split(_messages(bag))
        topics = sorted({connection.topic for connection in bag.connections})
    cut = _cut_off(path)
    if len(parts) > _MOST_RUNS:
        raise RecordingError(
            f"{shown(path)}: the stamps on {_JOINTS} or {_DOOR} go back by more than {_RESET:g} s "
            f"{len(parts) - 1} times, as those of two publishers with different clocks",
            value=len(parts), limit=_MOST_RUNS)
    runs = [run for run in map(_run, parts) if run is not None]
    if not runs:
        raise RecordingError(
            f"{shown(path)}: has no messages with finite positions on {_JOINTS} or {_DOOR}; topics "
            f"with messages: {', '.join(topics) or 'none'}{f'; {cut}' if cut else ''}",
            value=topics, limit=(_JOINTS, _DOOR))
    if cut:
        runs[-1] = replace(runs[-1], notes=(*runs[-1].notes, f"{cut}."))
    return runs


def _cut_off(path: Path) -> str:
    """Say which file of a recording lacks its end; empty if none does."""
    for file in sorted(path.glob("*.mcap")) if path.is_dir() else [path]:
        with suppress(OSError), file.open("rb") as stream:
            begin = stream.read(len(_MAGIC))
            stream.seek(-len(_MAGIC), os.SEEK_END)
            if begin == _MAGIC != stream.read():
                return f"{file.name} was cut off, what followed is missing"
    return ""


def _messages(bag: Bag) -> Iterator[tuple[str, float, Any]]:
    """Yield topic, stamp [s] and message or transform, in the order of the file.

    A topic whose type is not the expected one is left out.
    """
    wanted = [connection for connection in bag.connections if _TYPES.get(
        connection.topic, _WRENCH) == connection.msgtype]
    for connection, received, data in bag.messages(wanted):
        message = bag.deserialize(data, connection.msgtype)
        for part in getattr(message, "transforms", (message,)):
            stamp = None if connection.topic in _LATCHED else part.header.stamp
            own = 0.0 if stamp is None else float(stamp.sec + 1e-9 * stamp.nanosec)
            yield connection.topic, own or 1e-9 * received, part


def _split(messages: Iterable[tuple[str, float, Any]]) -> list[dict[str, _Rows]]:
    """Sort messages by runs and topics."""
    runs: list[dict[str, _Rows]] = [defaultdict(list)]
    clock, now = _DOOR, -math.inf  # topic that tells the time, and its last stamp
    for topic, stamp, message in messages:
        if topic == _JOINTS:
            clock = _JOINTS
        if topic == clock:
            if stamp < now - _RESET:
                runs.append(defaultdict(list, {
                    name: [(-math.inf, said) for _, said in runs[-1][name]] for name in _LATCHED}))
            now = stamp
        # A message of before the reset may come a little after it. A trajectory begins later.
        late = stamp > now + _RESET and topic not in (*_LATCHED, _TRAJECTORY) and len(runs) > 1
        runs[-2 if late else -1][topic].append((stamp, message))
    return runs


def _run(rows: dict[str, _Rows]) -> RecordedRun | None:
    """Make a run of its messages; None if nothing moves in it."""
    joints, joint_notes = _joints(rows[_JOINTS], _JOINTS)
    doors, door_notes = _joints(rows[_DOOR], _DOOR)
    joints, prefix = _described(rows[_ROBOT_URDF], joints, _JOINTS, joint_notes)
    doors, door_prefix = _described(rows[_DOOR_URDF], doors, _DOOR, door_notes)
    moving = joints or doors
    if not moving:
        return None
    hinge = dict(list(doors.items())[:1])
    hits = find_hits(rows[_PLAN], rows[_TRAJECTORY], next(iter(hinge.values()), None))
    points = {name: _series(rows[topic], lambda message: _xyz(message.point))
              for name, topic in (("ZMP", _ZMP), ("CoM", _COM))}
    polygons = [(t, np.array([[corner.x, corner.y] for corner in message.polygon.points]))
                for t, message in sorted(rows[_SUPPORT], key=lambda row: row[0])
                if len(message.polygon.points) >= 3]
    poses: dict[str, _Rows] = defaultdict(list)
    for stamp, part in rows["/tf"]:
        poses[part.child_frame_id].append((stamp, part.transform))
    for _, part in rows[_STATIC]:
        poses[part.child_frame_id] = [(0.0, part.transform)]
    robot, robot_notes = _body(rows[_ROBOT_URDF], joints, poses, prefix)
    door, _ = _body(rows[_DOOR_URDF] if doors else [], hinge, poses, door_prefix)
    return RecordedRun(
        t=np.unique(np.concatenate([series.t for series in moving.values()])), source="recorded",
        robot=robot, door=door,
        points={name: series for name, series in points.items() if series.t.size},
        support=Series(np.array([t for t, _ in polygons]), padded([each for _, each in polygons]))
        if polygons else None,
        margin=_margin(points["ZMP"], polygons) if polygons and points["ZMP"].t.size else None,
        phases=tuple(phase for hit in hits for phase in phases_of(hit.starts, hit.end)),
        events=tuple(event for hit in hits for event in events_of(hit.contact, hit.peak)),
        desired=tuple(hit.plan.desired_opening_angle for hit in hits),
        planned={each.phase: each.margin for hit in hits for each in hit.plan.zmp_margins},
        plots=_plots(rows),
        notes=(*robot_notes, *joint_notes, *door_notes, *([] if door is not None else [
            "The recording has no door: it needs /door_description and /door_angle."])))


def _described(urdfs: _Rows, joints: dict[str, Series], topic: str, notes: list[str],
               ) -> tuple[dict[str, Series], str]:
    """Return the samples of joints by the names of their description, and what preceded these.

    Where no recorded joint is in the description, one prefix may precede all, as of a robot among
    others. What was found is added to the notes.
    """
    names = {joint.name for joint in read_urdf(urdfs[-1][1].data).joints} if urdfs else set()
    if not names or not joints or names & joints.keys():
        return joints, ""
    tried = {joint.removesuffix(name) for joint in joints for name in names if joint.endswith(name)}
    common = [each for each in tried if all(joint.startswith(each) for joint in joints)]
    prefix = max(common, key=lambda each: sum(each + name in joints for name in names), default="")
    if not prefix:
        notes.append(f"No joint on {topic} is in the description, so none of it moves: there are "
                     f"{_list(list(joints))}, but in the description {_list(sorted(names))}.")
        return joints, ""
    notes.append(f"All joints on {topic} have the prefix {prefix}, which those of the description "
                 "have not: it is left out.")
    return {name.removeprefix(prefix): series for name, series in joints.items()}, prefix


def _body(urdfs: _Rows, joints: dict[str, Series], poses: dict[str, _Rows], prefix: str,
          ) -> tuple[Body | None, list[str]]:
    """Return a body, and sentences that say what the robot lacks."""
    if not urdfs:
        return None, [f"The recording has no {_ROBOT_URDF}: no robot is drawn."]
    urdf = urdfs[-1][1].data
    root = read_urdf(urdf).root
    found = _series(poses[root] or poses[prefix + root], _pose)
    if not joints:
        notes = [f"The recording has no joint angles on {_JOINTS}: the robot's joints do not move."]
    elif not found.t.size:
        notes = ["The recording has no /tf of the robot's base: the base stands at the origin."]
    else:
        notes = []
    return Body(urdf, joints, found if found.t.size else None), notes


def _plots(rows: dict[str, _Rows]) -> tuple[Plot, ...]:
    forces: dict[str, list[Curve]] = {}  # left and right share an axis; those of feet dwarf others
    for topic, color in zip(sorted(rows.keys() - _TYPES.keys()), _COLORS, strict=False):
        force = _series(rows[topic], lambda message: _xyz(message.wrench.force))
        label = topic.strip("/").removesuffix("/wrench").replace("_", " ")
        forces.setdefault(re.sub(r"\b(left|right) ", "", label), []).append(
            Curve(label, color, force.t, np.linalg.norm(force.values, axis=1)))
    speeds = [Curve("encoder", colors.DOOR, speed.t, np.degrees(speed.values[:, 0]))
              for speed in list(_joints(rows[_DOOR], _DOOR, "velocity")[0].values())[:1]]
    return (*(Plot(f"Force at the {end}", "N", tuple(curves)) for end, curves in forces.items()),
            Plot("Angular velocity of the door", "deg/s", tuple(speeds)))


def _margin(zmp: Series, polygons: list[tuple[float, Any]]) -> Series:
    """Return the distance of each ZMP from the edge of the last support polygon before it [m]."""
    margin = np.full(len(zmp.t), np.nan)
    ends = [stamp for stamp, _ in polygons[1:]] + [math.inf]
    for (stamp, corners), end in zip(polygons, ends, strict=True):
        rows = slice(*np.searchsorted(zmp.t, (stamp, min(end, stamp + LONGEST))))
        if rows.start < rows.stop:
            try:
                margin[rows] = polygon_margin(zmp.values[rows, :2], support_polygon(corners))
            except DegeneratePolygonError:
                continue
    return Series(zmp.t, margin)


def _xyz(point: Any) -> tuple[float, float, float]:
    return point.x, point.y, point.z


def _pose(transform: Any) -> tuple[float, ...]:
    turn = transform.rotation
    return (*_xyz(transform.translation), turn.w, turn.x, turn.y, turn.z)


def _series(rows: _Rows, values: Callable[[Any], Any]) -> Series:
    """Sort samples by their stamps; of two with the same stamp the first one stays.

    Samples that are no finite numbers are left out.
    """
    if not rows:
        return Series(np.empty(0), np.empty((0, 1)))
    t, index = np.unique(np.array([stamp for stamp, _ in rows]), return_index=True)
    found = np.array([values(rows[i][1]) for i in index], dtype=np.float64).reshape(len(t), -1)
    finite = np.isfinite(found).all(axis=1)
    return Series(t[finite], found[finite])


def _joints(rows: _Rows, topic: str, field: str = "position",
            ) -> tuple[dict[str, Series], list[str]]:
    """Return the samples of each joint, whichever messages name it, and sentences about bad ones.

    Messages may name other joints, or the same ones in another order. A joint without any finite
    sample is left out.
    """
    parts: dict[str, list[tuple[Array, Array]]] = defaultdict(list)
    groups: dict[tuple[str, ...], _Rows] = defaultdict(list)
    for stamp, message in rows:
        if len(getattr(message, field)) == len(message.name):
            groups[tuple(message.name)].append((stamp, message))
    for names, group in groups.items():
        t = np.array([stamp for stamp, _ in group])
        table = np.array([getattr(message, field) for _, message in group], dtype=np.float64)
        for name, column in zip(names, table.T, strict=True):
            parts[name].append((t, column))
    found: dict[str, Series] = {}
    bad, torn = [], []
    for name, columns in parts.items():
        t, values = (np.concatenate(each) for each in zip(*columns, strict=True))
        finite = np.isfinite(values)
        if not finite.all():
            bad.append(f"{name} ({np.sum(~finite)} of {len(t)})")
        t, values = t[finite], values[finite]
        if t.size:
            times, first, again = np.unique(t, return_index=True, return_inverse=True)
            if (values != values[first][again.reshape(-1)]).any():
                torn.append(name)
            found[name] = Series(times, values[first][:, None])
    notes = []
    if bad:
        notes.append(f"Samples on {topic} that are not finite are left out, between the others the "
                     f"motion is drawn as even, a joint without any is drawn at 0: {_list(bad)}.")
    if torn:
        notes.append(f"Messages on {topic} with the same stamp have different positions, as of two "
                     f"publishers; the first counts: {_list(torn)}.")
    return found, notes


def _list(names: Sequence[str]) -> str:
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return ", ".join(names[:_NAMED]) + more
