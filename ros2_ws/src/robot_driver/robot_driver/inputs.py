"""Passes the messages about robot and door to a motion: checked, and with their delay.

A motion is a hit, a walk or a passage. Each message passes `Intake`: what that drops reaches no
motion, and no motion begins from it. `Freshness` notices silent topics.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.driver_interface import Command
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.samples import NO_IMU, ImuSample, Measured
from numpy.typing import ArrayLike

from robot_driver.freshness import Freshness
from robot_driver.intake import Arrival, Intake
from robot_driver.motion import Motion
from robot_driver.names import DOOR, HAND, IMU, JOINTS, WRENCHES
from robot_driver.ranges import DOOR_ANGLE, FORCE, INERTIAL, joint_ranges
from robot_driver.stamp_matching import ImuMatcher, Match, StampPairer

ENOUGH = 0.2  # time of messages from which the sensors are judged before a motion [s]
RECENT = 60  # number of complete samples that are kept, 0.3 s at 200 Hz
_IMU_PATIENCE = 0.05  # a reading of the IMU counts for samples at most this far from it [s]
_FEET = "feet"  # both wrenches, as one part of a sample


class Inputs:
    """Passes messages about robot and door to the present motion.

    Args:
        robot: The robot.
        watches: Watches for silent topics. Each accepted message is noted in each of them.
        observes: Whether the motion only observes. It gets joint states without speeds (NaN), too,
            and complete samples of a robot whose IMU is silent, with `NO_IMU`.

    Attributes:
        motion: The present motion; None outside one. Its first messages are compared with the last
            ones before it.
        joints: Stamp [s], positions (J,) [rad] and speeds (J,) [rad/s] of the last joint state;
            None before the first one.
        since: Stamp of the first joint state [s]; NaN before it.
        tilt: Last angle of base_link's z axis to the vertical [rad]; NaN before the first one.
        door_angle: Last angle of the door [rad]; NaN before the first one.
        hand_force: Magnitude of the last force on the right hand [N]; NaN before the first one.
        lag: Time by which the last joint state lagged behind the present [s].
        recent: The last complete samples: joints and wrenches of one stamp, and the nearest
            reading of the IMU.
        intake: The checks, with the number of dropped messages.
    """

    def __init__(self, robot: RobotModel, *watches: Freshness, observes: bool = False) -> None:
        self._robot = robot
        self.motion: Motion | None = None
        self._observes = observes
        self.intake = Intake({
            JOINTS: joint_ranges(robot), IMU: INERTIAL, DOOR: DOOR_ANGLE,
            **dict.fromkeys((*WRENCHES.values(), HAND), FORCE)})
        self._watches = watches
        self._clear()

    def _clear(self) -> None:
        self.joints: tuple[float, Array, Array] | None = None
        self.since = self.tilt = self.door_angle = self.hand_force = math.nan
        self.lag = 0.0
        self.recent: deque[Measured] = deque(maxlen=RECENT)
        self._feet = StampPairer(tuple(WRENCHES))
        self._samples = StampPairer((JOINTS, _FEET))
        self._readings = ImuMatcher(_IMU_PATIENCE)

    def needs(self, topics: Sequence[str]) -> None:
        """Set the topics whose silence ends the present motion."""
        for watch in self._watches:
            watch.needed = topics

    def complete(self, topics: Sequence[str]) -> bool:
        """Return whether messages have arrived on topics, for `ENOUGH` on joint states."""
        return (all(watch.complete(topics) for watch in self._watches)
                and self.joints is not None and self.joints[0] - self.since >= ENOUGH)

    @property
    def unpaired(self) -> int:
        """Number of joint states and wrenches without another one of their control period."""
        return self._feet.dropped + self._samples.dropped

    def forget(self) -> None:
        """Forget all messages and give up the motion: the robot's clock went back."""
        self.intake.forget()
        self._begin_anew()

    def _begin_anew(self) -> None:
        self._clear()
        for watch in self._watches:
            watch.forget()
        if self.motion is not None:
            self.motion.give_up("the motion was given up: the robot's clock went back")

    def on_joints(self, arrival: Arrival, position: Array, velocity: Array) -> list[Command]:
        """Handle a joint state.

        Args:
            arrival: Times of the message.
            position: Joint positions, (J,) [rad].
            velocity: Joint speeds, (J,) [rad/s].

        Returns:
            Commands for the driver.
        """
        known = np.nan_to_num(velocity) if self._observes else velocity
        if not self._accepted(JOINTS, arrival, np.concatenate([position, known])):
            return []
        if self.joints is None:
            self.since = arrival.stamp
        self.joints, self.lag = (arrival.stamp, position, velocity), arrival.lag
        commands = self.motion.on_joints(*self.joints) if self.motion else []
        return commands + self._together(JOINTS, arrival, (position, velocity))

    def on_imu(self, arrival: Arrival, reading: ImuSample) -> list[Command]:
        """Handle a reading of the IMU, as `on_joints`."""
        position = self._robot.config.half_sitting if self.joints is None else self.joints[1]
        tilt = self._robot.base_tilt(position, reading.rotation)
        values = (tilt, *reading.angular_velocity, *reading.specific_force)
        if not self._accepted(IMU, arrival, values):
            return []
        self.tilt = tilt
        commands = self.motion.on_imu(
            arrival.stamp, tilt, reading.specific_force) if self.motion else []
        return commands + self._measured(
            arrival, self._readings.add_reading(arrival.stamp, reading))

    def on_wrench(self, side: str, arrival: Arrival, wrench: Array) -> list[Command]:
        """Handle force and torque of the floor on a sole, (6,) [N, N m], as `on_joints`."""
        if not self._accepted(WRENCHES[side], arrival, wrench):
            return []
        feet = self._feet.add(side, arrival.stamp, wrench)
        if feet is None:
            return []
        stamp, pair = feet
        commands = self.motion.on_wrenches(
            stamp, pair["left"], pair["right"]) if self.motion else []
        return commands + self._together(_FEET, arrival._replace(stamp=stamp), pair)

    def on_door(self, arrival: Arrival, angle: float, velocity: float) -> list[Command]:
        """Handle an angle [rad] and an angular velocity [rad/s] of the door, as `on_joints`."""
        if not self._accepted(DOOR, arrival, (angle, velocity)):
            return []
        self.door_angle = angle
        return self.motion.on_door(arrival.stamp, angle, velocity) if self.motion else []

    def on_hand(self, arrival: Arrival, wrench: Array) -> list[Command]:
        """Handle force and torque on the right hand, (6,) [N, N m], as `on_joints`."""
        if not self._accepted(HAND, arrival, wrench):
            return []
        self.hand_force = float(np.linalg.norm(wrench[:3]))
        return self.motion.on_hand(arrival.stamp, self.hand_force) if self.motion else []

    def on_silence(self, topic: str, waited: float, limit: float) -> list[Command]:
        """Handle a topic without a message for a time [s] that exceeds its limit [s]."""
        if self.motion is None or self.joints is None:
            return []
        now = self.joints[0] + (waited if topic == JOINTS else 0.0)
        return self.motion.on_silence(now, topic, waited, limit)

    def on_failure(self, error: Exception) -> list[Command]:
        """Handle an error of the program in a motion."""
        if self.motion is None or self.joints is None:
            return []
        return self.motion.on_failure(self.joints[0], error)

    def _together(self, part: str, arrival: Arrival, content: Any) -> list[Command]:
        """Pass on the sample of one time when the last of its messages has arrived."""
        sample = self._samples.add(part, arrival.stamp, content)
        return [] if sample is None else self._measured(
            arrival, self._readings.add_sample(*sample))

    def _measured(self, arrival: Arrival, samples: Sequence[Match]) -> list[Command]:
        """Pass on samples that have waited for a reading of the IMU until a message arrived."""
        commands: list[Command] = []
        for stamp, parts, imu in samples:
            if imu is None and not self._observes:
                continue
            (position, velocity), feet = parts[JOINTS], parts[_FEET]
            self.recent.append(Measured(
                position, velocity, imu or NO_IMU, feet["left"], feet["right"], stamp))
            if self.motion is not None:
                self.motion.lags(arrival._replace(stamp=stamp).lag)
                commands += self.motion.on_measured(stamp, self.recent[-1])
        return commands

    def _accepted(self, topic: str, arrival: Arrival, values: ArrayLike) -> bool:
        motion = self.motion if self.motion is not None and self.motion.running else None
        clocks = self.intake.clocks
        if not self.intake.accept(topic, arrival, values, in_motion=motion is not None):
            return False
        if self.intake.clocks > clocks:
            self._begin_anew()
        if motion is not None:
            motion.lags(arrival.lag)
        for watch in self._watches:
            watch.received(topic, arrival.stamp)
        return True
