"""Describe a run, of the simulation or of hardware, as the page of it needs it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from door_impact_common.arrays import Array
from door_impact_view.replay.recording import CONTACT, Event, Phase, Plot
from door_impact_view.scene.poses import on_floor

PEAK = "peak"
"""Name of the moment of the door's largest angle after a hit."""


@dataclass(frozen=True)
class Series:
    """Samples over time: `t` (n,) [s], increasing, and `values` (n, ...)."""

    t: Array
    values: Array


@dataclass(frozen=True)
class Body:
    """A robot or a door that moves.

    Attributes:
        urdf: Its description.
        joints: Positions (n, 1) of joints by their names [rad] or [m].
        base: Poses of the root link (n, 7): place, quaternion w, x, y, z; None where unknown.
    """

    urdf: str
    joints: Mapping[str, Series]
    base: Series | None


@dataclass(frozen=True)
class RecordedRun:
    """What was recorded of a run; everything but the times may be missing.

    Attributes:
        t: Times of the samples of the motion (n,) [s], increasing.
        source: Where the curves come from, for readers: "simulated" or "recorded".
        robot: The robot.
        door: The door; its only joint is the hinge.
        points: Places by name, "ZMP" and "CoM", (n, 2) or (n, 3) in odom [m].
        support: Corners of the support polygon (n, K, 3) in odom [m], as `padded` makes them.
        margin: Distance of the ZMP from the polygon's edge, negative outside (n,) [m].
        phases: Named spans, in order.
        events: Named moments, in order; around each but the peak there are more samples.
        desired: Desired angles of the door [rad].
        planned: Smallest ZMP margin that the plan has for a phase, by the phase's name [m].
        plots: What else was measured.
        notes: Sentences that say what is missing.
    """

    t: Array
    source: str
    robot: Body | None = None
    door: Body | None = None
    points: dict[str, Series] = field(default_factory=dict)
    support: Series | None = None
    margin: Series | None = None
    phases: tuple[Phase, ...] = ()
    events: tuple[Event, ...] = ()
    desired: tuple[float, ...] = ()
    planned: dict[str, float] = field(default_factory=dict)
    plots: tuple[Plot, ...] = ()
    notes: tuple[str, ...] = ()


def phases_of(starts: Sequence[tuple[float, str]], end: float) -> tuple[Phase, ...]:
    """Return phases that follow each other, of their starts and names and the last one's end."""
    ends = [start for start, _ in starts[1:]] + [end]
    return tuple(Phase(name, start, stop)
                 for (start, name), stop in zip(starts, ends, strict=True) if stop > start)


def events_of(contact: float | None, peak: float | None) -> tuple[Event, ...]:
    """Return the moments of a hit [s], each where it is known."""
    return tuple(Event(name, time) for name, time in ((CONTACT, contact), (PEAK, peak))
                 if time is not None and np.isfinite(time))


def padded(polygons: Sequence[Array]) -> Array:
    """Return polygons (K, 2) with different numbers of corners as one array (n, K, 3).

    They lie on the floor. The last corner is repeated, which leaves a polygon as it is. An empty
    polygon is NaN.
    """
    most = max((len(polygon) for polygon in polygons), default=0)
    rows = np.full((len(polygons), max(most, 3), 3), np.nan)
    for row, polygon in zip(rows, polygons, strict=True):
        if len(polygon):
            row[:] = on_floor(np.pad(polygon, ((0, len(row) - len(polygon)), (0, 0)), "edge"))
    return rows
