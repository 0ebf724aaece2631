"""A planned phase of the motion, and what would happen if the door stood elsewhere."""

from __future__ import annotations

from dataclasses import dataclass

from door_impact_common.arrays import Array
from humanoid_motion.clearance import Clearance, LeafCourse
from humanoid_motion.knots import Knots


@dataclass(frozen=True)
class PhasePlan:
    """A phase of a plan.

    Attributes:
        name: As in the contract.
        knots: Of the 30 joints; times count from the start of the phase.
        com: At the knots, in odom, (K, 3) [m].
        zmp: At the knots, on the floor in odom, (K, 2) [m].
        time: Of the dense samples, (N,) [s].
        com_samples: (N, 3) [m].
        zmp_samples: (N, 2) [m].
        margin: Smallest distance of the ZMP to the edge of the support polygon [m].
        friction: Largest ratio of tangential to normal floor force.
        torque_ratio: Largest joint torque as a share of its limit.
        speed_ratio: Largest joint speed as a share of its limit.
        clearances: Nearest bodies of the robot, and nearest body to the leaf where there is one.
        leaf: Where the leaf is at the dense samples; None where it was not looked at. After the
            peak it has fallen for `hold.LATE` more.
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
    leaf: LeafCourse | None = None


@dataclass(frozen=True)
class Branches:
    """What if the door is not where it was said to be.

    Attributes:
        early_margin: Smallest ZMP margin after the hit of a door that is nearer by the stated
            uncertainty [m].
        late_margin: The same for one that is farther.
        point_of_no_return: A stop begun later than this before the contact no longer keeps the
            ZMP margin, or comes to the leaf [s].
        stop_duration: From the begin of a stop before that to rest [s].
        missed_margin: Distance of the capture point to the soles' edge where the contact is missed
            for good, where the legs reach no further [m]; negative: the robot falls.
        rest_duration: From when the legs have slowed down after the hit to rest [s].
    """

    early_margin: float
    late_margin: float
    point_of_no_return: float
    stop_duration: float
    missed_margin: float
    rest_duration: float

    @property
    def recovery_step(self) -> float:
        """How much nearer to the door a foot would have to be put after a missed contact [m]."""
        return max(0.0, -self.missed_margin)
