"""Passes the messages about the robot to the walk: checked, and with their delay.

Outside a walk only the latest measurements are kept, from which a walk begins.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.driver.freshness import Freshness
from door_impact_common.driver.intake import Arrival, Intake
from door_impact_common.driver.names import IMU, JOINTS, WRENCHES
from door_impact_common.driver.ranges import FORCE, INERTIAL, joint_ranges
from humanoid_motion.driver_interface import Command, ImuSample
from numpy.typing import ArrayLike

from walking.execution.walk import Outcome, Walk
from walking.footsteps.footstep import Pose
from walking.recovery.estimate import Measured

STANDS = "the driver finishes the trajectory that it has, which ends with the robot standing"


@dataclass
class Latest:
    """The last measurements; None, NaN or empty before the first ones.

    Attributes:
        joints: Stamp [s], positions (J,) [rad] and speeds (J,) [rad/s].
        tilt: Angle between the trunk and the vertical [rad].
        base: Pose of base_link in odom by the odometry, as seen from above.
        zmp: Stamp [s] and ZMP in odom, (2,) [m].
        lag: Time by which the last joint state lagged behind the present [s].
    """

    joints: tuple[float, Array, Array] | None = None
    tilt: float = math.nan
    base: Pose | None = None
    zmp: tuple[float, Array] | None = None
    lag: float = 0.0


class Inputs:
    """Passes messages about the robot to the present walk.

    Args:
        speed_limit: Speed limits of the joints, (J,) [rad/s].
        watches: Watches for silent topics. Each accepted message is noted in each of them.

    Attributes:
        walk: The present walk; None if the robot stands.
        latest: The last measurements.
        intake: The checks, with the number of dropped messages.
    """

    def __init__(self, speed_limit: Array, *watches: Freshness) -> None:
        self.walk: Walk | None = None
        self.latest = Latest()
        self.intake = Intake({
            JOINTS: joint_ranges(speed_limit), IMU: INERTIAL,
            **dict.fromkeys(WRENCHES.values(), FORCE)})
        self._watches = watches
        # Stamp [s] and content of the last message of each topic that a recovery needs.
        self._parts: dict[str, tuple[float, Any]] = {}

    @property
    def joints(self) -> tuple[float, Array, Array] | None:
        """Stamp [s], positions [rad] and speeds [rad/s] of the last joint state, if any."""
        return self.latest.joints

    def forget(self) -> None:
        """Forget all messages and give up the walk: the robot's clock went back."""
        self.latest = Latest()
        self._parts.clear()
        for watch in self._watches:
            watch.forget()
        if self.walk is not None:
            self.walk.give_up("the walk was given up: the robot's clock went back")

    def on_joints(self, arrival: Arrival, position: Array, velocity: Array) -> list[Command]:
        """Handle a joint state.

        Args:
            arrival: Times of the message.
            position: Joint positions, (J,) [rad].
            velocity: Joint speeds, (J,) [rad/s].

        Returns:
            Commands for the driver.
        """
        if not self._accepted(JOINTS, arrival, np.concatenate([position, velocity])):
            return []
        self.latest.joints = (arrival.stamp, position, velocity)
        self.latest.lag = arrival.lag
        if self.walk is None:
            return []
        commands = self.walk.on_joints(arrival.stamp, position)
        return commands + self._together(JOINTS, arrival.stamp, (position, velocity))

    def on_imu(self, arrival: Arrival, tilt: float, reading: ImuSample) -> list[Command]:
        """Handle a reading of the IMU.

        Args:
            arrival: Times of the message.
            tilt: Angle between the trunk and the vertical [rad].

        Returns:
            Commands for the driver.
        """
        if not self._accepted(
                IMU, arrival, (tilt, *reading.angular_velocity, *reading.specific_force)):
            return []
        self.latest.tilt = tilt
        if self.walk is None:
            return []
        return self.walk.on_tilt(tilt) + self._together(IMU, arrival.stamp, reading)

    def on_wrench(self, side: str, arrival: Arrival, wrench: Array) -> list[Command]:
        """Handle force and moment of the floor on a sole, (6,) [N, N m], as `on_joints`."""
        topic = WRENCHES[side]
        if not self._accepted(topic, arrival, wrench):
            return []
        return self._together(topic, arrival.stamp, wrench)

    def _together(self, topic: str, stamp: float, content: Any) -> list[Command]:
        """Pass on the measurements of one tick when the last of them has arrived."""
        self._parts[topic] = (stamp, content)
        stamps = {each for each, _ in self._parts.values()}
        if self.walk is None or len(self._parts) < 2 + len(WRENCHES) or len(stamps) > 1:
            return []
        position, velocity = self._parts[JOINTS][1]
        left, right = (self._parts[WRENCHES[side]][1] for side in ("left", "right"))
        return self.walk.on_measured(
            stamp, Measured(position, velocity, self._parts[IMU][1], left, right))

    def on_silence(self, topic: str, waited: float, limit: float) -> list[Command]:
        """Handle a topic without a message for a time [s] that exceeds its limit [s]."""
        if self.walk is not None:
            self.walk.give_up(
                f"no message has arrived on {topic} for {waited:.2f} s, at most {limit:g} s are "
                f"allowed; {STANDS}")
        return []

    def on_failure(self, error: Exception) -> list[Command]:
        """Handle an error of the program in a walk: make no further step."""
        if self.walk is not None:
            self.walk.give_up(f"the walker failed: {type(error).__name__}: {error}; {STANDS}")
        return []

    def _accepted(self, topic: str, arrival: Arrival, values: ArrayLike) -> bool:
        """Check a message in a walk; a message outside a walk is only kept."""
        if self.walk is None or self.walk.outcome is not Outcome.RUNNING:
            self.intake.keep(topic, arrival, values)
        elif not self.intake.accept(topic, arrival, values):
            return False
        else:
            self.walk.lag = arrival.lag
        for watch in self._watches:
            watch.received(topic, arrival.stamp)
        return True
