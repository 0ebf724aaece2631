"""Hold the latest that is known of robot and door."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.errors import DegeneratePolygonError
from hrp2_description.support import polygon_margin

from door_impact_view.scene.urdf import UrdfScene

STALE = 0.5  # age from which on a point is not shown any more [s]
Pose = tuple[Array, Array]
"""Place (3,) [m] and orientation as quaternion w, x, y, z, (4,)."""


@dataclass(frozen=True)
class Stamped:
    """A measured value and the time of its stamp [s]."""

    time: float
    value: Array


@dataclass(frozen=True)
class PlanSummary:
    """What the page shows of a plan.

    Attributes:
        rows: Quantities as (name, value with unit).
        margins: Smallest ZMP margin of each phase as (phase, margin [m]).
        warnings: Sentences.
    """

    rows: tuple[tuple[str, str], ...] = ()
    margins: tuple[tuple[str, float], ...] = ()
    warnings: tuple[str, ...] = ()


@dataclass
class Body:
    """The robot or the door.

    Attributes:
        text: Its URDF.
        scene: What the last URDF that could be read shows.
        problem: Sentence about what cannot be drawn; empty if everything can.
        pose: Pose of its root link in the world.
        joints: Positions of its joints by name [rad] or [m].
    """

    text: str = ""
    scene: UrdfScene | None = None
    problem: str = ""
    pose: Pose | None = None
    joints: Mapping[str, float] = field(default_factory=dict)


@dataclass
class State:
    """The latest of everything that is shown; what has not come yet is empty or None.

    Attributes:
        robot: The robot.
        door: The door.
        now: Stamp of the robot's joints [s].
        door_angle: Opening angle, (1,) [rad].
        zmp: ZMP in the world, (2,) [m].
        com: CoM in the world, (3,) [m].
        polygon: Corners of the support polygon, counter-clockwise, (M, 2) [m].
        forces: Force of the surroundings on each link that has a sensor, in the link's frame,
            (3,) [N] by link.
        hands: Names of those links that are hands.
        imu: Angular velocity [rad/s] and specific force [m/s^2] in the IMU's frame, (6,).
        plan: The last plan.
        phase: What the robot is doing, whoever wanted it; empty if it does nothing.
        moving: Names of the orders behind that, as `panels.Order` has them.
        served: Names of the orders that a node would take.
        speed: Time of the graph per real time; None as long as it is not known.
        paused: Whether the simulation stands still because somebody wants it.
        footsteps: Corners of the soles that will stand on the floor, (N, 4, 2) [m].
    """

    robot: Body = field(default_factory=Body)
    door: Body = field(default_factory=Body)
    now: float | None = None
    door_angle: Stamped | None = None
    zmp: Stamped | None = None
    com: Stamped | None = None
    polygon: Stamped | None = None
    forces: dict[str, Stamped] = field(default_factory=dict)
    hands: frozenset[str] = frozenset()
    imu: Stamped | None = None
    plan: PlanSummary | None = None
    phase: str = ""
    moving: frozenset[str] = frozenset()
    served: frozenset[str] = frozenset()
    speed: float | None = None
    paused: bool = False
    footsteps: Array = field(default_factory=lambda: np.zeros((0, 4, 2)))

    @property
    def problem(self) -> str:
        """Sentence about what cannot be drawn; empty if everything can."""
        return self.robot.problem or self.door.problem

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
