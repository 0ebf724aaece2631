"""Parts of a replay that are the same for a recording and for the simulation's log."""

from collections.abc import Mapping, Sequence

import numpy as np
from door_impact_common.arrays import Array
from door_impact_view.replay.recording import (
    CONTACT,
    Camera,
    Curve,
    Event,
    Limit,
    Phase,
    Plot,
    Tree,
)
from door_impact_view.scene import colors
from door_impact_view.scene.floor import on_floor
from door_impact_view.scene.poses import rotate
from door_impact_view.scene.urdf import SLIDING, TURNING

PEAK = "peak"
"""Name of the moment of the door's largest angle after a hit."""
FORCE_COLORS = (colors.COM, colors.FORCE, colors.CAPTURE_POINT, colors.DOOR)


def phases_of(starts: Sequence[tuple[float, str]], end: float) -> tuple[Phase, ...]:
    """Returns phases that follow each other, from their starts and names and the last one's end."""
    ends = [start for start, _ in starts[1:]] + [end]
    return tuple(Phase(name, start, stop)
                 for (start, name), stop in zip(starts, ends, strict=True) if stop > start)


def events_of(contact: float | None, peak: float | None) -> tuple[Event, ...]:
    """Returns the moments of a hit, each where it is known."""
    return tuple(Event(name, time) for name, time in ((CONTACT, contact), (PEAK, peak))
                 if time is not None)


def door_plot(curve: Curve, desired: Sequence[float]) -> Plot:
    """Returns the plot of the door's angle [deg], with the desired angles [rad]."""
    limits = tuple(Limit("desired", round(float(np.degrees(angle)), 3))
                   for angle in dict.fromkeys(desired) if np.isfinite(angle))
    return Plot("Angle of the door", "deg", (curve,), limits)


def margin_plot(t: Array, margin: Array, planned: Mapping[str, float],
                phases: Sequence[Phase]) -> Plot:
    """Returns the plot of the ZMP margin.

    Args:
        t: Times (n,) [s].
        margin: Distance of the ZMP from the edge of the support polygon, negative outside (n,) [m].
        planned: Smallest margin that the plan has for a phase, by the phase's name [m].
        phases: Phases of the motion.
    """
    steps = [(phase.start, phase.end, planned[phase.name])
             for phase in phases if phase.name in planned]
    curves = [Curve("measured", colors.ZMP, t, 1e3 * margin)]
    if steps:
        # Three samples a phase: its begin, almost its end, and a gap before the next one.
        times = np.ravel([(start, end - 2e-4, end - 1e-4) for start, end, _ in steps])
        values = np.ravel([(value, value, np.nan) for _, _, value in steps])
        curves.append(Curve("least planned", colors.COM, times, 1e3 * values, dashed=True))
    return Plot("ZMP margin", "mm", tuple(curves), (Limit("edge", 0.0),))


def padded(polygons: Sequence[Array]) -> Array:
    """Returns polygons (K, 2) with different numbers of corners as one array (n, K, 3).

    They lie on the floor. The last corner is repeated, which leaves a polygon as it is. An empty
    polygon is NaN.
    """
    most = max((len(polygon) for polygon in polygons), default=0)
    rows = np.full((len(polygons), max(most, 3), 3), np.nan)
    for row, polygon in zip(rows, polygons, strict=True):
        if len(polygon):
            filled = np.vstack([polygon, np.repeat(polygon[-1:], len(row) - len(polygon), axis=0)])
            row[:] = on_floor(filled)
    return rows


def cameras(robot: Tree, door: Tree | None, contact_point: Array | None) -> tuple[Camera, ...]:
    """Returns places to look from: the robot's front, its side, above, and along the leaf.

    Args:
        robot: The robot.
        door: The door; None leaves the choice to the page.
        contact_point: Where the robot hits the leaf, (3,) [m]; None where it is not known.
    """
    leaf = None if door is None else _leaf_middle(door)
    if leaf is None:
        return ()
    base = np.median(robot.base, axis=0)
    up = np.array([0.0, 0.0, 1.0])
    ahead = _level(rotate(base[3:], np.array([1.0, 0.0, 0.0])))
    # Of the robot's four sides the one nearest the door: the hit is sideways, a passage is not.
    towards = max((ahead, -ahead, np.cross(up, ahead), -np.cross(up, ahead)),
                  key=lambda side: float(side @ (leaf - base[:3])))
    forward = np.cross(towards, -up) if abs(towards @ ahead) > 0.5 else ahead
    middle = 0.5 * (base[:3] + leaf)
    middle[2] = 0.8
    near = leaf
    if contact_point is not None and np.isfinite(contact_point).all():
        near = contact_point
    return (
        _camera("from the front", middle + 2.7 * forward - 1.1 * towards + 0.6 * up, middle),
        _camera("towards the door", middle - 3.0 * towards - 1.2 * forward + 0.8 * up, middle),
        # Not exactly from above: there the camera's own vertical would be undefined.
        _camera("from above", middle + 3.6 * up - 0.02 * towards, middle),
        _camera("along the leaf", near + 1.9 * forward - 0.12 * towards + 0.1 * up, near),
    )


def _leaf_middle(door: Tree) -> Array | None:
    """Returns the middle of the shape that the door's joint moves, at its first sample [m]."""
    moving = {joint.child for joint in door.scene.joints if joint.kind in TURNING + SLIDING}
    shapes = [shape for shape in door.scene.shapes if shape.link in moving]
    if not shapes:
        return None
    return np.asarray(door.base[0, :3] + rotate(door.base[0, 3:], shapes[0].place))


def _level(direction: Array) -> Array:
    """Returns a direction (3,) made horizontal and of length 1; x if the direction is vertical."""
    level = np.array([direction[0], direction[1], 0.0])
    length = float(np.linalg.norm(level))
    return level / length if length > 1e-9 else np.array([1.0, 0.0, 0.0])


def _camera(name: str, position: Array, target: Array) -> Camera:
    x, y, z = (round(float(value), 4) for value in position)
    a, b, c = (round(float(value), 4) for value in target)
    return Camera(name, (x, y, z), (a, b, c))
