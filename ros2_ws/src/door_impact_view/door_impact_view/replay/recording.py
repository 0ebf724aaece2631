"""A recorded motion, as the replay shows it: of any robot, with or without a door.

Times are seconds on the recording's own clock; places are metres in the world's frame;
quaternions are w, x, y, z.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array

from door_impact_view.scene.colors import Rgb
from door_impact_view.scene.urdf import UrdfScene

CONTACT = "contact"
"""Name of the events around which the replay is slow."""


@dataclass(frozen=True)
class Tree:
    """A robot or a door that moves.

    Attributes:
        scene: Its links, joints and shapes.
        joints: Names of the joints that were recorded, J of them.
        positions: Their positions at the replay's stamps, (N, J) [rad] or [m].
        base: Place and orientation of the root link in the world at the stamps, (N, 7), or (1, 7)
            if it does not move.
    """

    scene: UrdfScene
    joints: tuple[str, ...]
    positions: Array
    base: Array


@dataclass(frozen=True)
class Mark:
    """A point or a convex polygon that moves, such as the ZMP or the support polygon.

    Attributes:
        name: Name for readers.
        color: Its colour.
        places: Places at the replay's stamps, (N, 3) of a point, (N, K, 3) of a polygon's corners;
            NaN where it is unknown.
    """

    name: str
    color: Rgb
    places: Array


@dataclass(frozen=True)
class Phase:
    """A named part of the motion, from `start` to `end` [s]."""

    name: str
    start: float
    end: float


@dataclass(frozen=True)
class Event:
    """A named moment `time` [s]."""

    name: str
    time: float


@dataclass(frozen=True)
class Curve:
    """A curve of a plot.

    Attributes:
        label: Name for readers.
        color: Its colour.
        t: Its own sample times (n,) [s].
        values: Its values (n,) in the plot's unit; NaN makes a gap.
        dashed: Whether it is dashed: what was planned, beside what was measured.
    """

    label: str
    color: Rgb
    t: Array
    values: Array
    dashed: bool = False


@dataclass(frozen=True)
class Limit:
    """A value that a plot marks by a dotted line."""

    label: str
    value: float
    color: Rgb = (85, 85, 85)


@dataclass(frozen=True)
class Plot:
    """Curves over time with one unit."""

    title: str
    unit: str
    curves: tuple[Curve, ...]
    limits: tuple[Limit, ...] = ()


@dataclass(frozen=True)
class Camera:
    """A place from which the scene is looked at, and the point in the middle of the picture [m]."""

    name: str
    position: tuple[float, float, float]
    target: tuple[float, float, float]


@dataclass(frozen=True)
class Replay:
    """A recorded motion.

    Attributes:
        stamps: Times of the samples of trees and marks, (N,) [s], increasing; denser where more
            happens.
        trees: What moves.
        marks: Points and polygons.
        phases: Parts of the motion, in order.
        events: Moments, in order.
        plots: Plots, from the top down.
        cameras: Places to look from, the first one at the start; empty for those of
            `cameras_around`.
        notes: Sentences that say what the recording lacks.
        name: Name for readers, where a page shows several.
    """

    stamps: Array
    trees: tuple[Tree, ...] = ()
    marks: tuple[Mark, ...] = ()
    phases: tuple[Phase, ...] = ()
    events: tuple[Event, ...] = ()
    plots: tuple[Plot, ...] = ()
    cameras: tuple[Camera, ...] = ()
    notes: tuple[str, ...] = ()
    name: str = ""

    @property
    def begin(self) -> float:
        """Time that is shown at first [s]: that of the last contact, or the start."""
        return self._contacts[-1] if self._contacts else float(self.stamps[0])

    @property
    def slow(self) -> list[tuple[float, float, float]]:
        """Begin and end [s] of parts that are played at most at a speed, and this speed."""
        return [(time - before, time + after, speed)
                for time in self._contacts for before, after, speed in _SLOW]

    @property
    def _contacts(self) -> list[float]:
        return [event.time for event in self.events if event.name == CONTACT]


_SLOW = ((0.4, 0.8, 0.25), (0.03, 0.09, 0.02))
"""Time before and after a contact [s], and recorded time over real time there: the hit itself lasts
some 20 ms, so that it takes a second at 1/50."""


def cameras_around(replay: Replay) -> tuple[Camera, ...]:
    """Return places to look from, around the places that the first tree's base passes."""
    middle = np.zeros(3)
    reach = 1.0
    if replay.trees:
        places = replay.trees[0].base[:, :3]
        low, high = places.min(axis=0), places.max(axis=0)
        middle = 0.5 * (low + high)
        reach += 0.5 * float(np.max(high - low))
    x, y, z = (float(value) for value in middle)
    far = 2.4 * reach
    return (
        Camera("oblique", (x + 0.9 * far, y + 0.7 * far, z + 0.4 * far), (x, y, z)),
        Camera("front", (x + 1.2 * far, y, z + 0.2), (x, y, z)),
        Camera("side", (x, y + 1.2 * far, z + 0.2), (x, y, z)),
        # Not exactly from above: there the camera's own vertical would be undefined.
        Camera("above", (x - 0.01, y, z + 1.5 * far), (x, y, z)),
    )
