"""A planned walk: knots for the driver, courses of ZMP and CoM, and what the checks found."""

from __future__ import annotations

from dataclasses import dataclass

from door_impact_common.arrays import Array
from humanoid_motion.clearance import Clearance
from humanoid_motion.knots import Knots
from humanoid_motion.motion import Motion

from walking.footsteps.footstep import Footstep, Stance
from walking.pattern.state import WalkState
from walking.pattern.timing import Phase, Schedule


@dataclass(frozen=True)
class WalkChecks:
    """What the checks of a walk found.

    Attributes:
        margin: Distance of the ZMP from the edge of the support polygon at each sample, (N,) [m].
        speed_ratio: Largest speed of each joint as a share of its limit, (J,).
        torque_ratio: Largest torque of each joint as a share of its limit, (J,).
        friction: Coefficient of friction that the soles need at each sample, (N,).
        clearance: The two bodies of the robot that come nearest to their limit; None if this was
            not checked.
    """

    margin: Array
    speed_ratio: Array
    torque_ratio: Array
    friction: Array
    clearance: Clearance | None


@dataclass(frozen=True)
class WalkPlan:
    """A walk that ends with the robot standing still on two feet.

    Attributes:
        knots: Knots of all joints; times count from the beginning of the walk.
        motion: The whole-body motion at the knots.
        com: CoM at the knots in odom, (N, 3) [m].
        zmp: ZMP of the whole body at the knots in odom, (N, 2) [m].
        zmp_reference: Reference of the ZMP at the knots in odom, (N, 2) [m].
        schedule: Phases of the walk.
        footsteps: The footsteps.
        boundaries: State at the beginning of each step's double support, and at that of the end,
            one more than footsteps. A new plan can begin there.
        final: State at rest after the walk.
        checks: What the checks found.
    """

    knots: Knots
    motion: Motion
    com: Array
    zmp: Array
    zmp_reference: Array
    schedule: Schedule
    footsteps: tuple[Footstep, ...]
    boundaries: tuple[WalkState, ...]
    final: WalkState
    checks: WalkChecks

    @property
    def duration(self) -> float:
        """Time from the beginning to rest [s]."""
        return float(self.knots.time[-1])

    @property
    def stance(self) -> Stance:
        """The soles after the walk."""
        return self.final.stance

    def begin_of(self, step: int) -> float:
        """Return the time at which the double support before a footstep begins [s]."""
        return self.schedule.begin_of(step)

    def touchdown_of(self, step: int) -> float:
        """Return the time at which the foot of a footstep touches the floor [s]."""
        return self.schedule.touchdown_of(step)

    def phase_at(self, time: float) -> Phase:
        """Return the phase at a time since the beginning [s]; the last one after the end."""
        sample = time / self.schedule.period
        phases = self.schedule.phases
        return next((phase for phase in phases if sample < phase.last - 1e-6), phases[-1])
