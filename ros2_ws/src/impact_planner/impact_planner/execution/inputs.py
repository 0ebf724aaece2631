"""Passes the messages about robot and door to the execution: checked, and with their delay.

Outside a run only the latest measurements are kept, from which a run begins. In a run each message
passes `Intake`; what it drops does not reach the execution. `Freshness` notices silent topics by
the robot's clock, and by the computer's steady clock, because a simulation that dies takes the
robot's clock with it.
"""

from __future__ import annotations

import math

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.driver.freshness import Freshness
from door_impact_common.driver.intake import Arrival, Intake, Plausible
from door_impact_common.driver.names import IMU, JOINTS, WRENCHES
from door_impact_common.driver.ranges import FORCE, INERTIAL, joint_ranges
from humanoid_motion.driver_interface import Command
from numpy.typing import ArrayLike

from impact_planner.execution.execution import Execution

DOOR = "/door_angle"

_DOOR_RATE = 6.0  # largest plausible speed of the door [rad/s]
_DOOR_SLACK = 0.02  # change of the door's angle that is always plausible [rad]


class Inputs:
    """Passes messages about robot and door to the present execution.

    Args:
        speed_limit: Speed limits of the joints, (J,) [rad/s].
        watches: Watches for silent topics. Each accepted message is noted in each of them.

    Attributes:
        execution: The present execution; None outside a run. The first messages of a run are
            compared with the last ones before it.
        joints: Stamp [s], positions (J,) [rad] and speeds (J,) [rad/s] of the last joint state;
            None before the first one.
        door_angle: Last angle of the door [rad]; NaN before the first one.
        intake: The checks, with the number of dropped messages.
    """

    def __init__(self, speed_limit: Array, *watches: Freshness) -> None:
        self.execution: Execution | None = None
        self.joints: tuple[float, Array, Array] | None = None
        self.door_angle = math.nan
        self.intake = Intake({
            JOINTS: joint_ranges(speed_limit),
            # angle and angular velocity
            DOOR: Plausible((np.inf, _DOOR_RATE), (_DOOR_RATE, np.inf), _DOOR_SLACK),
            IMU: INERTIAL,
            **dict.fromkeys(WRENCHES.values(), FORCE),
        })
        self._watches = watches
        # Stamp [s] and force towards the door [N] of the last wrench of each foot.
        self._forces: dict[str, tuple[float, float]] = {}

    def forget(self) -> None:
        """Forget all messages and give up the run: the robot's clock went back."""
        self.joints = None
        self._forces.clear()
        for watch in self._watches:
            watch.forget()
        if self.execution is not None:
            self.execution.give_up("the motion was given up: the robot's clock went back")

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
        self.joints = (arrival.stamp, position, velocity)
        if self.execution is None:
            return []
        return self.execution.on_joint_state(arrival.stamp, position, velocity)

    def on_door(self, arrival: Arrival, angle: float, velocity: float) -> list[Command]:
        """Handle an angle [rad] and an angular velocity [rad/s] of the door, as `on_joints`."""
        if not self._accepted(DOOR, arrival, (angle, velocity)):
            return []
        self.door_angle = angle
        if self.execution is None:
            return []
        return self.execution.on_door(arrival.stamp, angle, velocity)

    def on_imu(
        self, arrival: Arrival, tilt: float, rate: Array, force: Array | None
    ) -> list[Command]:
        """Handle a reading of the IMU.

        Args:
            arrival: Times of the message.
            tilt: Angle between the trunk and the vertical [rad].
            rate: Angular velocity in the IMU's frame, (3,) [rad/s].
            force: Specific force in the IMU's frame, (3,) [m/s^2]; None without an accelerometer.

        Returns:
            Commands for the driver.
        """
        checked = (tilt, *rate, *(np.zeros(3) if force is None else force))
        if not self._accepted(IMU, arrival, checked) or self.execution is None:
            return []
        return self.execution.on_imu(arrival.stamp, tilt, rate, force)

    def on_wrench(self, side: str, arrival: Arrival, force: float) -> list[Command]:
        """Handle the floor's force on a foot towards the door [N], as `on_joints`.

        The execution gets the sum of both feet's forces when their stamps are equal.
        """
        if not self._accepted(WRENCHES[side], arrival, force):
            return []
        self._forces[side] = (arrival.stamp, force)
        stamps, forces = zip(*self._forces.values(), strict=True)
        if self.execution is None or stamps != (arrival.stamp,) * len(WRENCHES):
            return []
        return self.execution.on_foot_forces(arrival.stamp, sum(forces))

    def on_silence(self, topic: str, waited: float, limit: float) -> list[Command]:
        """Handle a topic without a message for a time [s] that exceeds its limit [s]."""
        if self.execution is None or self.joints is None:
            return []
        now = self.joints[0] + (waited if topic == JOINTS else 0.0)
        return self.execution.on_silence(now, topic, waited, limit)

    def on_failure(self, error: Exception) -> list[Command]:
        """Handle an error of the program in a run: end the motion as safely as possible."""
        if self.execution is None or self.joints is None:
            return []
        return self.execution.on_failure(self.joints[0], error)

    def _accepted(self, topic: str, arrival: Arrival, values: ArrayLike) -> bool:
        """Check a message in a run; a message outside a run is only kept."""
        if self.execution is None:
            self.intake.keep(topic, arrival, values)
        elif not self.intake.accept(topic, arrival, values):
            return False
        else:
            self.execution.lags(arrival.lag)
        for watch in self._watches:
            watch.received(topic, arrival.stamp)
        return True
