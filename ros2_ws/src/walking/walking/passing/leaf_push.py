"""The leaf's angle while the robot passes: pushed open, held, and left to itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from door_model.door.door import Door
from door_model.motion.dynamics import follow_free
from humanoid_motion.motion import min_jerk_course


@dataclass(frozen=True)
class LeafPush:
    """A push of the leaf by the hand. Times count from the beginning of the walk.

    Attributes:
        door: Dynamics of the door.
        first: Angle at the beginning [rad].
        last: Angle up to which the leaf is pushed [rad].
        begin: Time at which the push begins [s].
        end: Time at which the leaf arrives [s].
        release: Time at which the hand lets it go [s].
    """

    door: Door
    first: float
    last: float
    begin: float
    end: float
    release: float

    def at(self, time: Array) -> Array:
        """Compute the leaf's angles at rising times, (N,) [rad]; after the release it falls."""
        rise, _, _ = min_jerk_course(time - self.begin, self.end - self.begin)
        angle = self.first + (self.last - self.first) * rise
        falls = time > self.release
        if falls.any():
            since = time[falls] - self.release
            angle[falls] = follow_free(
                self.door, self.last, 0.0, until=float(since[-1])).at(since)[0][:, 0]
        return np.asarray(angle)

    def pulls(self, share: float) -> bool:
        """Whether the hand would press with less than a share of the closer's torque at some time.

        A leaf that shall slow down faster than its closer slows it down leaves the hand.
        """
        time = np.linspace(self.begin, self.end, 50)
        closer = np.asarray(self.door.restoring_torque(self.at(time)))
        return bool((self.torque(time) < share * closer).any())

    def torque(self, time: Array) -> Array:
        """Compute the torque that the hand gives by eq. (1) at times, (N,) [N m]."""
        rise, speed, bend = (
            (self.last - self.first) * rows
            for rows in min_jerk_course(time - self.begin, self.end - self.begin))
        own = np.asarray(self.door.acceleration(self.first + rise, speed))
        return np.where(time <= self.release, self.door.i_a * (bend - own), 0.0)
