"""Make the replay of a recorded run, which `door_impact_view` shows as a page."""

import math

import numpy as np
from door_impact_common.arrays import Array
from door_impact_view.replay.recording import (
    CONTACT,
    Camera,
    Curve,
    Limit,
    Mark,
    Phase,
    Plot,
    Replay,
    Tree,
)
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
from door_impact_view.scene.poses import link_poses, on_floor, rotate
from door_impact_view.scene.urdf import TURNING, UrdfScene, read_urdf

from door_impact_evaluation.errors import RecordingError
from door_impact_evaluation.report.recorded_run import PEAK, Body, RecordedRun

LONGEST = 0.2
"""Longest time between two samples that are joined [s]."""

_PLOTTED = 200.0  # samples a second of a curve far from every moment [1/s]


def replay_of(run: RecordedRun, start: float | None = None, end: float | None = None) -> Replay:
    """Make the replay of a run.

    Args:
        run: The run.
        start: Time after its first sample at which the replay begins [s]; None: there.
        end: Time after its first sample at which it ends [s]; None: at its last sample.

    Raises:
        RecordingError: Nothing was recorded between `start` and `end`.
        UrdfError: The description of robot or door cannot be read.
    """
    since = run.t - run.t[0]
    t = run.t[(since >= (start or 0.0)) & (since <= (math.inf if end is None else end))]
    if t.size < 2:
        raise RecordingError(
            f"the recording lasts {since[-1]:.1f} s and has {t.size} samples between "
            f"{start or 0.0:g} and {since[-1] if end is None else end:g} s", value=(start, end),
            limit="two samples")
    events = tuple(event for event in run.events if t[0] <= event.time <= t[-1])
    moments = [event.time for event in events if event.name != PEAK]
    stamps = choose_stamps(t, moments)
    phases = tuple(
        Phase(phase.name, max(phase.start, float(t[0])), min(phase.end, float(t[-1])))
        for phase in run.phases if phase.start < t[-1] and phase.end > t[0])
    robot = None if run.robot is None else _tree(
        run.robot, read_urdf(run.robot.urdf), stamps)
    door = None if run.door is None else _tree(
        run.door, read_urdf(run.door.urdf), stamps)
    plots = (_cut(plot, t, moments) for plot in (*_plots(run, phases), *run.plots))
    return Replay(
        stamps=stamps,
        trees=tuple(tree for tree in (robot, door) if tree is not None),
        marks=_marks(run, stamps),
        phases=phases,
        events=events,
        plots=tuple(plot for plot in plots if plot.curves),
        cameras=() if door is None or robot is None or not any(
            event.name == CONTACT for event in events) else _cameras(door),
        notes=(*run.notes, *(
            f"No joint angles were recorded between {begin - t[0]:.2f} and {stop - t[0]:.2f} s: "
            "there the motion is drawn as even." for begin, stop in gaps(t, LONGEST)[:5])),
    )


def summary(replay: Replay) -> str:
    """Return how long a replay is and how many hits it shows, as text."""
    hits = sum(event.name == CONTACT for event in replay.events)
    duration = replay.stamps[-1] - replay.stamps[0]
    return f"{duration:.1f} s, {hits} hit{'' if hits == 1 else 's'}"


def _tree(body: Body, scene: UrdfScene, stamps: Array) -> Tree:
    known = tuple(joint.name for joint in scene.joints if joint.name in body.joints)
    positions = np.hstack([np.empty((len(stamps), 0)), *(
        at_stamps(body.joints[name].t, body.joints[name].values, stamps) for name in known)])
    if body.base is None:  # it stands on its lowest link
        first = dict(zip(known, positions[0].tolist(), strict=True))
        lowest = min(place[2] for place, _ in link_poses(scene, first).values())
        base = np.array([[0.0, 0.0, -lowest, 1.0, 0.0, 0.0, 0.0]])
    elif len(body.base.t) == 1:
        base = body.base.values
    else:
        base = poses_at_stamps(body.base.t, body.base.values, stamps)
    return Tree(scene, known, positions, base)


def _marks(run: RecordedRun, stamps: Array) -> tuple[Mark, ...]:
    marks = []
    if run.support is not None:
        marks.append(Mark("support polygon", colors.SUPPORT,
                          latest(run.support.t, run.support.values, stamps, LONGEST)))
    for name, color in (("ZMP", colors.ZMP), ("CoM", colors.COM)):
        if name not in run.points:
            continue
        places = between(run.points[name].t, run.points[name].values, stamps, LONGEST)
        if name == "CoM":
            marks.append(Mark(name, color, places))
            name = "CoM on the floor"
        marks.append(Mark(name, color, on_floor(places[:, :2])))
    return tuple(marks)


def _plots(run: RecordedRun, phases: tuple[Phase, ...]) -> list[Plot]:
    """Return the plots that every source has: the door's angle and the ZMP margin."""
    plots = []
    if run.door is not None:
        (angle,) = run.door.joints.values()
        limits = tuple(Limit("desired", round(math.degrees(each), 3))
                       for each in dict.fromkeys(run.desired) if math.isfinite(each))
        plots.append(Plot("Angle of the door", "deg", (Curve(
            run.source, colors.DOOR, angle.t, np.degrees(angle.values[:, 0])),), limits))
    if run.margin is not None:
        curves = [Curve(run.source, colors.ZMP, run.margin.t, 1e3 * run.margin.values)]
        steps = [(phase.start, phase.end, 1e3 * run.planned[phase.name])
                 for phase in phases if phase.name in run.planned]
        if steps:
            # Three samples a phase: its begin, almost its end, and a gap before the next one.
            times = np.ravel([(start, end - 2e-4, end - 1e-4) for start, end, _ in steps])
            values = np.ravel([(value, value, np.nan) for *_, value in steps])
            curves.append(Curve("least planned", colors.COM, times, values, dashed=True))
        plots.append(Plot("ZMP margin", "mm", tuple(curves), (Limit("edge", 0.0),)))
    return plots


def _cut(plot: Plot, t: Array, moments: list[float]) -> Plot:
    """Return the part of a plot within the times `t`, with samples enough for the eye."""
    curves = []
    for curve in plot.curves:
        inside = (curve.t >= t[0]) & (curve.t <= t[-1])
        times, values = curve.t[inside], curve.values[inside]
        if times.size and not curve.dashed:
            kept = np.isin(times, choose_stamps(times, moments, _PLOTTED))
            times, values = broken_at_gaps(times[kept], values[kept], LONGEST)
        if times.size:
            curves.append(Curve(curve.label, curve.color, times, values, curve.dashed))
    return Plot(plot.title, plot.unit, tuple(curves), plot.limits)


def _cameras(door: Tree) -> tuple[Camera, ...]:
    """Return places to look from, for a robot that comes from the door's side y > 0."""
    moving = {joint.child for joint in door.scene.joints if joint.kind in TURNING}
    leaf = next((shape.place for shape in door.scene.shapes if shape.link in moving), None)
    if leaf is None:
        return ()  # the page has places of its own
    ahead = math.copysign(1.0, leaf[0])  # from the hinge to the leaf's free edge
    near = leaf + (0.0, 0.3, -0.2)
    return tuple(
        Camera(name, *(tuple((door.base[0, :3] + rotate(door.base[0, 3:], place)).tolist())
                       for place in (target + (ahead * x, y, z), target)))
        for name, target, (x, y, z) in (
            ("from the front", near, (2.7, 1.1, 0.6)),
            ("towards the door", near, (-1.2, 3.0, 0.8)),
            # Not exactly from above: there the camera's own vertical would be undefined.
            ("from above", near, (0.0, 0.02, 3.6)),
            ("along the leaf", leaf, (1.9, 0.12, 0.1))))
