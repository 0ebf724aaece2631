"""Everything that turns the joints: motors with servos, gears that give, and the arm's brace.

Each joint has a motor and a gear. The motor's angle is counted behind the gear's ratio, so that
without load it equals the joint's angle. Between motor and link the gear is a spring and a damper;
the rotor's inertia lies on the motor's side of it. The servo is a PD controller of the motor's
angle whose torque is limited, as in a robot whose encoders are on its motors.
"""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from hrp2_description.drives_and_pads import Drives
from humanoid_motion.pinocchio_model import free_floating_model, joint_columns

from hrp2_sim_bridge.physics.brace import BracePads
from hrp2_sim_bridge.physics.engine import Engine, Reactions, SimulatedRobot
from hrp2_sim_bridge.settings import SAMPLE, WorldSettings

_BRACE_TOLERANCE = np.deg2rad(5.0)  # largest error of the posture in which the arm is locked [rad]
_FASTEST_PAD = 10.0  # upper bound of the speed of the arm's pad to the trunk's [m/s]
_FALLEN_TORQUE = 0.1  # share of the motors' torques that a fallen robot may use


class JointDrives:
    """Motors and gears of J joints, integrated with the steps of the physics engine.

    Args:
        robot: Configuration of the robot.
        drives: Its drives.
        position: Positions of the joints at the start, without load, (J,) [rad].

    Attributes:
        position: Angles of the motors, (J,) [rad].
        speed: Speeds of the motors, (J,) [rad/s].
        motor: Torques of the motors in the last step, (J,) [N m].
        gear: Torques of the gears on the links in the last step, (J,) [N m].
        link_inertia: Least inertia that each joint shows on the side of its link, (J,) [kg m^2].
        peak: Largest absolute torques of the gears since `clear_peak`, (J,) [N m].
        limit: Largest torques of the motors, (J,) [N m].
    """

    def __init__(self, robot: SimulatedRobot, drives: Drives, position: Array) -> None:
        self._data, self._rotor = drives, drives.inertia
        self.limit = np.array(robot.effort_limit)
        self._fastest = np.array(robot.velocity_limit)
        count = len(position)
        self._state = np.zeros((2, count))
        self.position, self.speed = self._state  # views
        self.position[:] = position
        self.motor, self.gear, self.peak = np.zeros((3, count))
        # Room for intermediate results: these steps are too small to make arrays in each of them.
        self._error, self._strain = np.empty((2, 2, count))
        self._work = np.empty(count)
        self._model = free_floating_model(robot)
        self._pinocchio = self._model.createData()
        self._q, (self._q_index, self._v_index) = (
            pin.neutral(self._model), joint_columns(self._model, robot.joint_names))
        self.set_step(SAMPLE, self.position)

    def clear_peak(self) -> None:
        """Begin to measure the largest torques of the gears anew."""
        self.peak[:] = 0.0

    def set_step(self, step: float, position: Array) -> None:
        """Set the length of the coming steps [s] and the posture (J,) [rad] in which they begin.

        Gears on very light links are stiffer than a step can follow, for instance those of the
        fingers, or of the shoulder where two of its axes are parallel. They are softened.
        """
        self._q[self._q_index] = position
        pin.computeMinverse(self._model, self._pinocchio, self._q)
        # The inertia of a joint when all others are free.
        self.link_inertia = np.asarray(1.0 / np.diag(self._pinocchio.Minv)[self._v_index])
        data, rotor = self._data, self._rotor
        together = 1.0 / (1.0 / rotor + 1.0 / self.link_inertia)
        self._gear_gains = np.array([
            np.minimum(data.stiffness, together / step**2),
            data.damping / (1.0 + step * data.damping / together)])
        # Implicit Euler of the servo, which is stable for any gains: at the end of the step its
        # torque is P (reference - angle') + D (rate - speed'), with rotor (speed' - speed) / step =
        # torque - gear and angle' = angle + step speed'. This is the torque as a sum over the
        # errors of angle and speed at the start, the gear's torque and the speed.
        share = rotor / (rotor + step * data.speed_gain + step**2 * data.position_gain)
        self._servo_gains = share * np.array([data.position_gain, data.speed_gain])
        self._per_gear = 1.0 - share
        self._per_speed = step * self._servo_gains[0]
        self._per_torque = step / rotor
        self._step = step

    def torque(self, order: Array, link: Array) -> Array:
        """Advance the motors by a step; return the torques of the gears on the links, (J,) [N m].

        Args:
            order: Reference of the motors' angles at the end of the step [rad] and its rate
                [rad/s], (2, J).
            link: Positions [rad] and speeds [rad/s] of the joints at the start, (2, J).
        """
        state, strain, error, work = self._state, self._strain, self._error, self._work
        gear, motor, speed = self.gear, self.motor, self.speed
        np.subtract(state, link, strain)
        np.multiply(strain, self._gear_gains, strain)
        np.add(strain[0], strain[1], gear)
        np.maximum(self.peak, np.abs(gear, out=work), out=self.peak)
        np.subtract(order, state, error)
        np.multiply(error, self._servo_gains, error)
        np.add(error[0], error[1], motor)
        motor += np.multiply(self._per_gear, gear, work)
        motor -= np.multiply(self._per_speed, speed, work)
        most = self.limit
        least = -most
        # `any` of a list of 30 takes half the time of NumPy's.
        if any((np.abs(speed, work) >= self._fastest).tolist()):
            # A motor at its largest speed drives no further; it can only brake.
            least, most = least * (speed > -self._fastest), most * (speed < self._fastest)
        np.maximum(motor, least, out=motor)
        np.minimum(motor, most, out=motor)
        np.subtract(motor, gear, work)
        speed += np.multiply(work, self._per_torque, work)
        self.position += np.multiply(speed, self._step, work)
        return gear


class Actuation:
    """Drives and brace of a robot in a physics engine.

    Args:
        engine: Engine in which the robot stands.
        robot: Configuration of the robot.
        settings: Kind of the brace, and multiples of rotors, gears, servos and pads.
        posture: Joint positions at the start, (J,) [rad].

    Attributes:
        drives: Motors and gears.
        pads: Pads of arm and trunk; None if the brace is no contact.
        state: Positions [rad] and velocities [rad/s] of the joints after the last step, (2, J).
    """

    def __init__(
        self, engine: Engine, robot: SimulatedRobot, settings: WorldSettings, posture: Array
    ) -> None:
        scaled = robot.drives.scaled(
            rotor=settings.rotor_scale, gear=settings.gear_scale, servo=settings.servo_scale)
        self.drives = JointDrives(robot, scaled, posture)
        self.pads = None
        if settings.brace == "contact" and robot.brace is not None:
            self.pads = BracePads(robot, robot.brace, settings.pad_scale)
        self._engine = engine
        self._effort = np.array(robot.effort_limit)
        self._locks = [robot.index(name) for name in robot.braced_joints]
        self._locking = settings.brace == "rigid"
        self._indices = [robot.index(name) for name in robot.braced_posture]
        self._posture = np.array(list(robot.braced_posture.values()))
        self._locked = False
        self._step = 0.0
        self.state = engine.joint_state()
        self._apart = 0  # milliseconds in which the pads cannot meet

    @property
    def motors(self) -> Array:
        """Angles [rad], speeds [rad/s] and torques [N m] of the motors, (3, J)."""
        return np.array([self.drives.position, self.drives.speed, self.drives.motor])

    def begin_tick(self, reference: Array, step: float, *, near: bool, fell: bool) -> bool:
        """Prepare the steps of a tick; return whether the braced joints are locked.

        Args:
            reference: Commanded posture at its start, (J,) [rad].
            step: Length of its physics steps [s].
            near: Whether the robot is near the leaf.
            fell: Whether the robot has fallen.
        """
        self._step = step
        self.drives.set_step(step, self.state[0])
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
        self.pads.linearize(self.state[0])
        if self.pads.clearance == 0.0:
            self.pads.soften(self._step, self.drives.link_inertia)
        # Positions that are not finite end the tick with an error of the engine.
        if math.isfinite(self.pads.clearance):
            self._apart = int(self.pads.clearance / (_FASTEST_PAD * SAMPLE))

    def step(self, order: Array, door_torque: float) -> Reactions:
        """Take a physics step; return forces and torques at the force sensors.

        Args:
            order: Reference of the joints at its end [rad] and its mean rate [rad/s], (2, J).
            door_torque: Torque on the leaf [N m].
        """
        torque = self.drives.torque(order, self.state)
        if self.pads is not None and self.pads.clearance == 0.0:
            position, speed = self.state
            torque = torque + self.pads.torque(position, speed, self._step)
        reactions = self._engine.step(torque, door_torque)
        self.state = self._engine.joint_state()
        return reactions
