"""Answers pushes on a robot that stands: before, between and after walks, and after a hit.

While nothing moves the robot, a plan that rests in its present posture takes the place of a walk.
A push that the soles cannot bear changes this plan as it would change a walk: the robot makes
recovery steps, and stands on two feet again.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY
from door_impact_common.errors import DoorImpactError
from humanoid_motion.driver_interface import Command
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.samples import Measured
from humanoid_motion.splice import without_first
from humanoid_motion.tolerances import STILL
from robot_driver.motion import Motion
from walking.footsteps.footstep import Footstep
from walking.pattern.plan import plan_walk
from walking.pattern.state import WalkState

from motion_execution.settings import ExecutionSettings
from motion_execution.walk.start import require_near
from motion_execution.walk.walk import Walk

_REST = 1.0  # time at rest after which a robot is watched, and after which this is tried again [s]
_LOADED = 0.7  # share of the weight that the soles bear when the robot stands
_LIFTED = 0.3  # share of the weight below which it is being lifted
_MOVED = 0.03  # distance of a slow joint from the posture at rest: something moves it [rad]
_GAP = 0.1  # time between two measurements after which the robot is watched anew [s]


class Guard(Motion):
    """Watches the balance of a robot that stands, and makes it step.

    Args:
        free: Function that returns whether nothing else moves the robot.
        state: Function that returns the state of rest in which the robot is.
            It raises a DoorImpactError where that is not known, or the robot does not stand.
    """

    def __init__(
        self, robot: RobotModel, free: Callable[[], bool], state: Callable[[], WalkState],
    ) -> None:
        self._robot, self._free, self._state = robot, free, state
        self._weight = robot.mass * GRAVITY
        self.forget()

    def forget(self) -> None:
        """Begin anew: the robot is watched when it has been at rest for a while."""
        self._walk: Walk | None = None  # along a plan that rests in the present posture
        self._posture = np.empty(0)  # joints when it was planned [rad]
        self._last = -math.inf  # stamp of the last measurements [s]
        self._since = math.inf  # stamp since which the robot has been at rest [s]

    @property
    def running(self) -> bool:
        """Whether a push would be answered now, or is being answered."""
        return self._walk is not None

    @property
    def steps(self) -> tuple[Footstep, ...]:
        """The recovery steps under way; empty while the robot stands."""
        return self._walk.plan.footsteps if self._walk is not None else ()

    def lags(self, seconds: float) -> None:
        """Set the time by which the next event lags behind the present [s]."""
        if self._walk is not None:
            self._walk.lags(seconds)

    def stop(self, why: str = "") -> None:
        """Begin anew: recovery steps under way are finished."""
        self.forget()

    def give_up(self, why: str) -> None:
        """Begin anew; the driver finishes what it has, which ends with the robot standing."""
        self.forget()

    def on_joints(self, now: float, position: Array, velocity: Array) -> list[Command]:
        """Handle joint positions [rad] and speeds [rad/s], (J,) each."""
        if self._walk is None or not self.steps:
            return []
        return self._after(self._walk.on_joints(now, position, velocity))

    def on_imu(self, now: float, tilt: float, force: Array) -> list[Command]:
        """Handle a reading of the IMU while the robot steps."""
        if self._walk is None or not self.steps:
            return []
        return self._after(self._walk.on_imu(now, tilt, force))

    def on_measured(self, now: float, measured: Measured) -> list[Command]:
        """Step if a push has moved the capture point too far."""
        if self._walk is not None and self.steps:
            return self._after(self._walk.on_measured(now, measured))
        load = float(measured.left_wrench[2] + measured.right_wrench[2]) / self._weight
        still = float(np.abs(measured.velocity).max()) <= STILL
        moved = (self._walk is not None and still  # not by a push, which is fast
                 and float(np.abs(measured.position - self._posture).max()) > _MOVED)
        current = self._last <= now <= self._last + _GAP
        if not current or moved or not load >= _LIFTED or not self._free():
            self.forget()
        self._last = now
        if self._walk is None:
            self._settle(now, measured.position, at_rest=still and load >= _LOADED)
            return []
        self._walk.start(now)
        # The motors hold the posture only nearly: the driver joins from its own reference.
        return [replace(command, knots=command.knots and without_first(command.knots))
                for command in self._walk.on_measured(now, measured)]

    def _after(self, commands: list[Command]) -> list[Command]:
        """Begin anew when the robot stands again, or has fallen."""
        if self._walk is not None and not self._walk.running:
            self.forget()
        return commands

    def _settle(self, now: float, position: Array, *, at_rest: bool) -> None:
        """Plan to rest in the present posture when the robot has been at rest for a while."""
        if not at_rest or now < self._since:
            self._since = now
        if not at_rest or now < self._since + _REST or not self._free():
            return
        self._since = now
        try:
            plan = plan_walk(self._robot, self._state(), [], clearance=False)
            require_near(self._robot, plan.knots.position[0], position)
            self._walk = Walk(self._robot, plan, settings=ExecutionSettings(lead=0.0))
            self._posture = position
        except DoorImpactError:
            return  # no step is possible from here; this may change
