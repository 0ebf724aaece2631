"""What is known of robot and door at this moment, and what is drawn of the last seconds."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.errors import DegeneratePolygonError
from hrp2_description.support import polygon_margin

SPAN = 20.0  # time that plots show [s]
STALE = 0.5  # age from which on a point is not shown any more [s]
Pose = tuple[Array, Array]
"""Place (3,) [m] and orientation as quaternion w, x, y, z, (4,)."""


@dataclass(frozen=True)
class Stamped:
    """A measured value and its time.

    Attributes:
        time: Stamp [s].
        value: The value.
    """

    time: float
    value: Array


@dataclass(frozen=True)
class PlanSummary:
    """What the page shows of a plan.

    Attributes:
        plan_id: Name of the plan.
        rows: Quantities as (name, value with unit).
        margins: Smallest ZMP margin of each phase as (phase, margin [m]).
        warnings: Sentences.
    """

    plan_id: str
    rows: tuple[tuple[str, str], ...] = ()
    margins: tuple[tuple[str, float], ...] = ()
    warnings: tuple[str, ...] = ()


@dataclass
class State:
    """The latest of everything that is shown; what has not come yet is empty or None.

    Attributes:
        robot: URDF of the robot.
        door: URDF of the door.
        joints: Positions of the robot's joints by name [rad] or [m].
        now: Stamp of these positions [s].
        base: Pose of the robot's root link in the world.
        door_joints: Positions of the door's joints by name [rad].
        door_frame: Pose of the door's root link in the world.
        door_angle: Opening angle, (1,) [rad].
        zmp: ZMP in the world, (2,) [m].
        com: CoM in the world, (3,) [m].
        polygon: Corners of the support polygon, counter-clockwise, (M, 2) [m].
        forces: Force of the surroundings on each link that has a sensor, in the link's frame,
            (3,) [N] by link.
        hands: Names of those links that are hands.
        plan: The last plan.
        phase: What the executor is doing; empty if it does nothing.
    """

    robot: str = ""
    door: str = ""
    joints: Mapping[str, float] = field(default_factory=dict)
    now: float | None = None
    base: Pose | None = None
    door_joints: Mapping[str, float] = field(default_factory=dict)
    door_frame: Pose | None = None
    door_angle: Stamped | None = None
    zmp: Stamped | None = None
    com: Stamped | None = None
    polygon: Stamped | None = None
    forces: dict[str, Stamped] = field(default_factory=dict)
    hands: frozenset[str] = frozenset()
    plan: PlanSummary | None = None
    phase: str = ""

    def fresh(self, item: Stamped | None) -> Array | None:
        """Return the value of an item, or None if it is old.

        The joints' positions, which a driver publishes all the time, tell what time it is. An item
        from after that is from before a reset of the clock. Without joints every item is fresh.
        """
        if item is None or (self.now is not None and abs(self.now - item.time) > STALE):
            return None
        return item.value

    def margin(self) -> float | None:
        """Return the distance of the ZMP to the edge of the support polygon [m], or None."""
        zmp, polygon = self.fresh(self.zmp), self.fresh(self.polygon)
        if zmp is None or polygon is None:
            return None
        try:
            return float(polygon_margin(zmp, polygon))
        except DegeneratePolygonError:
            return None


class History:
    """The values of one or several curves over the last seconds.

    Args:
        curves: Number of curves.
        span: How far back it reaches [s].
    """

    def __init__(self, curves: int = 1, span: float = SPAN) -> None:
        self._span = span
        self._curves = curves
        self._rows: deque[tuple[float, ...]] = deque()

    def add(self, time: float, *values: float) -> None:
        """Add a sample; one that is not newer than the last is no news, an old one starts anew.

        Args:
            time: Stamp [s].
            values: Value of each curve.
        """
        rows = self._rows
        if rows and time < rows[-1][0]:
            rows.clear()  # the simulation was started again
        if not rows or time > rows[-1][0]:
            rows.append((time, *values))
        while time - rows[0][0] > self._span:
            rows.popleft()

    def curves(self) -> tuple[Array, ...]:
        """Return times before the newest sample, (N,) [s], and the values of each curve, (N,)."""
        if not self._rows:
            return tuple(np.zeros((1 + self._curves, 0)))
        table = np.array(self._rows).T
        table[0] -= table[0, -1]
        return tuple(table)
