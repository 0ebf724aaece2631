"""The joints' drives: motors with a position servo, and gears that give.

Each joint has a motor and a gear. The motor's angle is counted behind the gear's ratio, so that
without load it equals the joint's angle. Between motor and link the gear is a spring and a damper;
the rotor's inertia lies on the motor's side of it. The servo is a PD controller of the motor's
angle whose torque is limited, as in a robot whose encoders are on its motors.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from hrp2_description.robot import Drives, RobotConfig
from humanoid_motion.pinocchio_model import free_floating_model, joint_columns

from hrp2_sim_bridge.settings import SAMPLE


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

    def __init__(self, robot: RobotConfig, drives: Drives, position: Array) -> None:
        self._data, self._rotor = drives, drives.inertia
        self.limit = np.array(robot.effort_limit)
        self._fastest = np.array(robot.velocity_limit)
        self.position = np.array(position, dtype=float)
        self._inertia = _LeastInertia(robot)
        self.speed = np.zeros(len(self.position))
        self.motor = np.zeros(len(self.position))
        self.gear = np.zeros(len(self.position))
        self.peak = np.zeros(len(self.position))
        self.set_step(SAMPLE, self.position)

    def clear_peak(self) -> None:
        """Begin to measure the largest torques of the gears anew."""
        self.peak = np.zeros(len(self.position))

    def set_step(self, step: float, position: Array) -> None:
        """Set the length of the coming steps [s] and the posture (30,) [rad] in which they begin.

        Gears on very light links are stiffer than a step can follow, for instance those of the
        fingers, or of the shoulder where two of its axes are parallel. They are softened.
        """
        self.link_inertia = self._inertia.at(position)
        data = self._data
        together = 1.0 / (1.0 / self._rotor + 1.0 / self.link_inertia)
        self._stiffness = np.minimum(data.stiffness, together / step**2)
        self._damping = data.damping / (1.0 + step * data.damping / together)
        # Implicit Euler of the servo: it is stable for any gains.
        self._yield = 1.0 / (
            self._rotor + step * data.speed_gain + step**2 * data.position_gain)
        self._per_torque, self._per_speed = step / self._rotor, self._rotor / step
        # NumPy multiplies by an array in half the time that it needs for a float.
        self._steps = np.full(len(self.position), step)

    def torque(self, reference: Array, rate: Array, position: Array, speed: Array) -> Array:
        """Advance the motors by a step; return the torques of the gears on the links, (J,) [N m].

        Args:
            reference: Reference of the motors' angles at the end of the step, (J,) [rad].
            rate: Its rate, (J,) [rad/s].
            position: Positions of the joints at the start of the step, (J,) [rad].
            speed: Their speeds, (J,) [rad/s].
        """
        data, steps, angle, turning = self._data, self._steps, self.position, self.speed
        gear = self._stiffness * (angle - position) + self._damping * (turning - speed)
        self.peak = np.maximum(self.peak, np.abs(gear))
        wanted = data.position_gain * (reference - angle) + data.speed_gain * rate
        ahead = (self._rotor * turning + steps * (wanted - gear)) * self._yield
        motor = self._per_speed * (ahead - turning) + gear
        most = self.limit
        least = -most
        # `any` of a list of 30 takes half the time of NumPy's.
        if any((np.abs(turning) >= self._fastest).tolist()):
            # A motor at its largest speed drives no further; it can only brake.
            least, most = least * (turning > -self._fastest), most * (turning < self._fastest)
        self.gear, self.motor = gear, np.minimum(np.maximum(motor, least), most)
        self.speed = turning + self._per_torque * (self.motor - gear)
        self.position = angle + steps * self.speed
        return gear


class _LeastInertia:
    """Inertia that each joint shows on its link's side when all other joints are free.

    Args:
        robot: Configuration of the robot.
    """

    def __init__(self, robot: RobotConfig) -> None:
        self._model = free_floating_model(robot)
        self._data = self._model.createData()
        self._q_index, self._v_index = joint_columns(self._model, robot.joint_names)
        self._q = pin.neutral(self._model)

    def at(self, position: Array) -> Array:
        """Compute the inertias at joint positions (30,) [rad], (30,) [kg m^2]."""
        self._q[self._q_index] = position
        pin.computeMinverse(self._model, self._data, self._q)
        return np.asarray(1.0 / np.diag(self._data.Minv)[self._v_index])
