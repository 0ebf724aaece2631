"""Turns a recording of topics into a replay: of the simulation or of hardware, whatever it has."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from door_impact_common.arrays import Array
from door_impact_view.replay.recording import CONTACT, Curve, Mark, Plot, Replay, Tree
from door_impact_view.replay.resampling import (
    at_stamps,
    between,
    broken_at_gaps,
    choose_stamps,
    gaps,
    latest,
    poses_at_stamps,
)
from door_impact_view.scene import colors
from door_impact_view.scene.floor import on_floor
from door_impact_view.scene.poses import IDENTITY, link_poses
from door_impact_view.scene.urdf import UrdfScene, read_urdf
from door_impact_view.scene.wall import with_wall
from hrp2_description.support import DegeneratePolygonError, polygon_margin, support_polygon

from door_impact_evaluation.errors import RecordingError
from door_impact_evaluation.report import replay_parts as parts
from door_impact_evaluation.report.bag import JOINTS, Angles, Bag, Series
from door_impact_evaluation.report.hits import Hit, find_hits

_LONGEST = 0.2  # longest time between two samples that are joined [s]


def replays_of(runs: Sequence[Bag], start: float | None = None,
               end: float | None = None) -> list[Replay]:
    """Makes a replay of each run of a recording that lasts long enough.

    Args:
        runs: The runs, at least one.
        start: As for `replay_of`.
        end: As for `replay_of`.

    Raises:
        RecordingError: In no run was anything recorded between `start` and `end`.
        UrdfError: The description of robot or door cannot be read.
    """
    made: list[Replay] = []
    problem: RecordingError | None = None
    for number, run in enumerate(runs, start=1):
        try:
            replay = replay_of(run, start, end)
        except RecordingError as error:
            problem = error
        else:
            made.append(replace(replay, name=f"{number} of {len(runs)}: {summary(replay)}"))
    if not made and problem is not None:
        raise problem
    return made


def summary(replay: Replay) -> str:
    """Returns how long a replay is and how many hits it shows, as text."""
    hits = sum(event.name == CONTACT for event in replay.events)
    duration = replay.stamps[-1] - replay.stamps[0]
    return f"{duration:.1f} s, {hits} hit{'' if hits == 1 else 's'}"


def replay_of(bag: Bag, start: float | None = None, end: float | None = None) -> Replay:
    """Makes a replay of a run.

    Args:
        bag: What was recorded of it.
        start: Time after its first sample at which the replay begins [s]; None: there.
        end: Time after its first sample at which it ends [s]; None: at its last sample.

    Raises:
        RecordingError: Nothing was recorded between `start` and `end`.
        UrdfError: The description of robot or door cannot be read.
    """
    main = bag.joints[0].positions.t if bag.joints else _door(bag).positions.t
    low = main[0] + (start or 0.0)
    high = main[-1] if end is None else main[0] + end
    kept = main[(main >= low) & (main <= high)]
    if kept.size < 2:
        raise RecordingError(
            f"the recording lasts {main[-1] - main[0]:.1f} s and has {kept.size} samples between "
            f"{low - main[0]:g} and {high - main[0]:g} s", value=(start, end),
            limit="two samples")
    hits = [hit for hit in find_hits(bag) if hit.end > kept[0] and hit.starts[0][0] < kept[-1]]
    inside = [event for hit in hits for event in parts.events_of(hit.contact, hit.peak)
              if kept[0] <= event.time <= kept[-1]]
    stamps = choose_stamps(kept, [event.time for event in inside if event.name != parts.PEAK])
    phases = tuple(phase for hit in hits for phase in parts.phases_of(
        [(min(max(time, kept[0]), kept[-1]), name) for time, name in hit.starts],
        min(hit.end, kept[-1])))
    robot, door = _robot(bag, stamps), _door_tree(bag, stamps)
    return Replay(
        stamps=stamps,
        trees=tuple(tree for tree in (robot, door) if tree is not None),
        marks=_marks(bag, stamps),
        phases=phases,
        events=tuple(inside),
        plots=_plots(bag, hits, phases, (float(kept[0]), float(kept[-1]))),
        cameras=parts.cameras(robot, door, _contact_point(hits)) if robot is not None else (),
        notes=_notes(bag, kept),
    )


def _robot(bag: Bag, stamps: Array) -> Tree | None:
    if "robot" not in bag.descriptions:
        return None
    scene = read_urdf(bag.descriptions["robot"])
    columns: dict[str, Array] = {}
    for angles in reversed(bag.joints):  # the most frequent publisher's angles count
        found = at_stamps(angles.positions.t, angles.positions.values, stamps)
        columns |= dict(zip(angles.names, found.T, strict=True))
    known = tuple(joint.name for joint in scene.joints if joint.name in columns)
    positions = np.column_stack([columns[name] for name in known]) if known else np.zeros((1, 0))
    base = _base(bag, scene, stamps)
    if scene.root not in bag.poses:  # it stands on its lowest link
        first = {name: float(column[0]) for name, column in columns.items()}
        base[0, 2] = -min(place[2] for place, _ in link_poses(scene, first).values())
    return Tree(scene, known, positions, base)


def _base(bag: Bag, scene: UrdfScene, stamps: Array) -> Array:
    """Returns the poses of a tree's root link; at the origin where none was recorded."""
    poses = bag.poses.get(scene.root)
    if poses is None:
        return np.concatenate([np.zeros(3), IDENTITY])[None]
    if len(poses.t) == 1:
        return poses.values
    return poses_at_stamps(poses.t, poses.values, stamps)


def _door(bag: Bag) -> Angles:
    if bag.door is None:
        raise RecordingError("the recording has neither joint angles nor the angle of a door")
    return bag.door


def _door_tree(bag: Bag, stamps: Array) -> Tree | None:
    if "door" not in bag.descriptions or bag.door is None:
        return None
    angle = bag.door.positions
    scene = with_wall(read_urdf(bag.descriptions["door"]))
    return Tree(scene, bag.door.names, at_stamps(angle.t, angle.values, stamps),
                _base(bag, scene, stamps))


def _marks(bag: Bag, stamps: Array) -> tuple[Mark, ...]:
    marks = []
    if bag.polygons:
        times = np.array([stamp for stamp, _ in bag.polygons])
        corners = parts.padded([corners for _, corners in bag.polygons])
        marks.append(Mark("support polygon", colors.SUPPORT,
                          latest(times, corners, stamps, _LONGEST)))
    if "/zmp" in bag.points:
        zmp = bag.points["/zmp"]
        places = between(zmp.t, zmp.values, stamps, _LONGEST)
        marks.append(Mark("ZMP", colors.ZMP, on_floor(places[:, :2])))
    if "/com" in bag.points:
        com = bag.points["/com"]
        places = between(com.t, com.values, stamps, _LONGEST)
        marks.append(Mark("CoM", colors.COM, places))
        marks.append(Mark("CoM on the floor", colors.COM,
                          on_floor(places[:, :2])))
    return tuple(marks)


def _plots(bag: Bag, hits: list[Hit], phases: tuple[parts.Phase, ...],
           shown: tuple[float, float]) -> tuple[Plot, ...]:
    plots = []
    desired = [hit.plan.desired_opening_angle for hit in hits]
    if bag.door is not None:
        plots.append(parts.door_plot(
            _curve("encoder", colors.DOOR, bag.door.positions, shown, np.degrees(1.0)), desired))
    margin = _margins(bag, shown)
    if margin is not None:
        planned = {each.phase: each.margin for hit in hits for each in hit.plan.zmp_margins}
        plots.append(parts.margin_plot(*broken_at_gaps(
            margin.t, margin.values[:, 0], _LONGEST), planned, phases))
    forces = tuple(
        _curve(topic.strip("/").removesuffix("/wrench").replace("_", " "), color,
               Series(wrench.t, np.linalg.norm(wrench.values, axis=1)[:, None]), shown)
        for (topic, wrench), color in zip(
            bag.wrenches.items(), parts.FORCE_COLORS, strict=False))
    if forces:
        plots.append(Plot("Force on feet and hands", "N", forces))
    if bag.door is not None and bag.door.velocity is not None:
        plots.append(Plot("Angular velocity of the door", "deg/s", (_curve(
            "encoder", colors.DOOR, bag.door.velocity, shown, np.degrees(1.0)),)))
    return tuple(plot for plot in plots if any(curve.t.size for curve in plot.curves))


def _curve(label: str, color: colors.Rgb, series: Series, shown: tuple[float, float],
           scale: float = 1.0) -> Curve:
    inside = (series.t >= shown[0]) & (series.t <= shown[1])
    return Curve(label, color, *broken_at_gaps(
        series.t[inside], scale * series.values[inside, 0], _LONGEST))


def _margins(bag: Bag, shown: tuple[float, float]) -> Series | None:
    """Returns the distance of each ZMP from the edge of the last support polygon before it [m]."""
    if "/zmp" not in bag.points or not bag.polygons:
        return None
    zmp = bag.points["/zmp"]
    inside = (zmp.t >= shown[0]) & (zmp.t <= shown[1])
    t, places = zmp.t[inside], zmp.values[inside, :2]
    margin = np.full((len(t), 1), np.nan)
    times = [stamp for stamp, _ in bag.polygons] + [np.inf]
    for k, (stamp, corners) in enumerate(bag.polygons):
        rows = slice(*np.searchsorted(t, (stamp, min(times[k + 1], stamp + _LONGEST))))
        if rows.start < rows.stop:
            try:
                margin[rows, 0] = polygon_margin(places[rows], support_polygon(corners))
            except DegeneratePolygonError:
                continue
    return Series(t, margin)


def _contact_point(hits: list[Hit]) -> Array | None:
    if not hits:
        return None
    point = hits[-1].plan.contact_point
    return np.array([point.x, point.y, point.z])


def _notes(bag: Bag, t: Array) -> tuple[str, ...]:
    """Returns sentences that say what the recording lacks."""
    notes = []
    if "robot" not in bag.descriptions:
        notes.append("The recording has no /robot_description: no robot is drawn.")
    elif not bag.joints:
        notes.append(f"The recording has no {JOINTS}: the robot's joints do not move.")
    elif read_urdf(bag.descriptions["robot"]).root not in bag.poses:
        notes.append("The recording has no /tf of the robot's base: the base stands at the origin.")
    if "door" not in bag.descriptions or bag.door is None:
        notes.append("The recording has no door: it needs /door_description and /door_angle.")
    for begin, end in gaps(t, _LONGEST)[:5]:
        notes.append(f"No joint angles were recorded between {begin - t[0]:.2f} and "
                     f"{end - t[0]:.2f} s: there the motion is drawn as even.")
    return tuple(notes)
