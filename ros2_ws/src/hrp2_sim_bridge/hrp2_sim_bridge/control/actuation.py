"""Everything that turns the joints: motors, gears, and the brace of the hitting arm."""

from __future__ import annotations

import math

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import RobotConfig, needed

from hrp2_sim_bridge.control.drives import JointDrives
from hrp2_sim_bridge.physics.brace import BracePads
from hrp2_sim_bridge.physics.engine import Engine
from hrp2_sim_bridge.physics.states import Reactions
from hrp2_sim_bridge.settings import SAMPLE, WorldSettings

_BRACE_TOLERANCE = np.deg2rad(5.0)  # largest error of the posture in which the arm is locked [rad]
_FASTEST_PAD = 10.0  # upper bound of the speed of the arm's pad to the trunk's [m/s]
_FALLEN_TORQUE = 0.1  # share of the motors' torques that a fallen robot may use


class Actuation:
    """Drives and brace of a robot in a physics engine.

    Args:
        engine: Engine in which the robot stands.
        robot: Configuration of the robot.
        settings: Kind of the brace, and multiples of rotors, gears, servos and pads.
        posture: Joint positions at the start, (30,) [rad].

    Attributes:
        drives: Motors and gears.
        pads: Pads of arm and trunk; None if the brace is no contact.

    Raises:
        RobotConfigError: The robot's configuration has no drives, or no pads where they are asked.
    """

    def __init__(
        self, engine: Engine, robot: RobotConfig, settings: WorldSettings, posture: Array
    ) -> None:
        scaled = needed(robot.drives, "drives").scaled(
            rotor=settings.rotor_scale, gear=settings.gear_scale, servo=settings.servo_scale)
        self.drives = JointDrives(robot, scaled, posture)
        self.pads = None
        if settings.brace == "contact":
            self.pads = BracePads(robot, needed(robot.brace, "brace"), settings.pad_scale)
        self._engine = engine
        self._effort = np.array(robot.effort_limit)
        self._locks = [robot.index(name) for name in robot.braced_joints]
        self._locking = settings.brace == "rigid"
        self._indices = [robot.index(name) for name in robot.braced_posture]
        self._posture = np.array(list(robot.braced_posture.values()))
        self._locked = False
        self._step = 0.0
        self._state = engine.joint_state()
        self._apart = 0  # milliseconds in which the pads cannot meet

    @property
    def joints(self) -> Array:
        """Positions [rad], velocities [rad/s] and motor torques [N m] of the joints, (3, 30)."""
        return np.array([*self._state, self.drives.motor])

    @property
    def motors(self) -> Array:
        """Angles [rad], speeds [rad/s] and torques [N m] of the motors, (3, 30)."""
        return np.array([self.drives.position, self.drives.speed, self.drives.motor])

    def begin_tick(self, reference: Array, step: float, *, near: bool, fell: bool) -> bool:
        """Prepare the steps of a tick.

        Args:
            reference: Commanded posture at its start, (30,) [rad].
            step: Length of its physics steps [s].
            near: Whether the robot is near the leaf.
            fell: Whether the robot has fallen.

        Returns:
            Whether the braced joints are locked.
        """
        self._step = step
        self.drives.set_step(step, self._state[0])
        self.drives.limit = _FALLEN_TORQUE * self._effort if fell else self._effort
        self.drives.clear_peak()
        if self.pads is not None:
            self.pads.clear()
        if self._locking:
            error = np.abs(reference[self._indices] - self._posture)
            locked = near and not fell and bool(error.max() < _BRACE_TOLERANCE)
            if locked != self._locked:
                self._engine.hold(self._locks if locked else [])
                self._locked = locked
        return self._locked

    def begin_sample(self) -> None:
        """Prepare the steps of a millisecond."""
        if self.pads is None:
            return
        if self._apart > 0:
            self._apart -= 1
            return
        self.pads.linearize(self._state[0])
        if self.pads.clearance == 0.0:
            self.pads.soften(self._step, self.drives.link_inertia)
        # Positions that are not finite end the tick with an error of the engine.
        if math.isfinite(self.pads.clearance):
            self._apart = int(self.pads.clearance / (_FASTEST_PAD * SAMPLE))

    def step(self, reference: Array, rate: Array, door_torque: float) -> Reactions:
        """Take a physics step.

        Args:
            reference: Reference of the joints at its end, (30,) [rad].
            rate: Mean rate of the reference in it, (30,) [rad/s].
            door_torque: Torque on the leaf [N m].

        Returns:
            Forces and torques of the ankles on the soles.
        """
        position, speed = self._state
        torque = self.drives.torque(reference, rate, position, speed)
        if self.pads is not None:
            torque = torque + self.pads.torque(position, speed, self._step)
        reactions = self._engine.step(torque, door_torque)
        self._state = self._engine.joint_state()
        return reactions
