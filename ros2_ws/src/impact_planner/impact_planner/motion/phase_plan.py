"""A planned phase of the motion, and the margins for a door that stands elsewhere."""

from __future__ import annotations

from dataclasses import dataclass

from door_impact_common.arrays import Array
from humanoid_motion.clearance import Clearance, LeafCourse
from humanoid_motion.knots import Knots


@dataclass(frozen=True)
class PhasePlan:
    """A phase of a plan.

    Attributes:
        name: Name of the phase: prepare, shift, step, back, cam, post, hold or retreat.
        knots: Knots of all joints; times count from the start of the phase.
        com: Places of the CoM at the knots in odom, (K, 3) [m].
        zmp: Places of the ZMP on the floor at the knots in odom, (K, 2) [m].
        time: Times of the dense samples, (N,) [s].
        com_samples: Places of the CoM at the dense samples in odom, (N, 3) [m].
        zmp_samples: Places of the ZMP at the dense samples in odom, (N, 2) [m].
        margin: Smallest distance of the ZMP from the edge of the support polygon [m].
        friction: Largest ratio of tangential to normal floor force.
        torque_ratio: Largest joint torque as a share of its limit.
        speed_ratio: Largest joint speed as a share of its limit.
        clearances: Smallest distance between bodies of the robot, from a body to the leaf and,
            where they are known, from a body to frame and wall.
        leaf: Course of the leaf at the dense samples; after the peak as it has fallen `catch.LATE`
            later.
    """

    name: str
    knots: Knots
    com: Array
    zmp: Array
    time: Array
    com_samples: Array
    zmp_samples: Array
    margin: float
    friction: float
    torque_ratio: float
    speed_ratio: float
    clearances: tuple[Clearance, ...]
    leaf: LeafCourse


@dataclass(frozen=True)
class Branches:
    """Margins for a door that does not stand where it was reported, and for a stop.

    Attributes:
        early_margin: Smallest ZMP margin after hitting a door that stands nearer by
            `door_uncertainty` [m].
        late_margin: Smallest ZMP margin after hitting a door that stands farther by
            `door_uncertainty` [m].
        point_of_no_return: Latest start of a safe stop, as time before the nominal contact [s]. A
            later stop breaks the ZMP margin or touches the leaf.
        stop_duration: Time from the start of a stop to rest [s].
        missed_margin: Distance of the capture point inside the soles when a missed contact is
            noticed and the run-up begins to brake [m] (`missed.missed_margin`).
        rest_duration: Time from the end of `slow_down` after the hit to rest [s].
    """

    early_margin: float
    late_margin: float
    point_of_no_return: float
    stop_duration: float
    missed_margin: float
    rest_duration: float
