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
from humanoid_motion.pinocchio_model import free_floating_model

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
        self._data, self._rotor, self._step = drives, drives.inertia, 0.0
        self.link_inertia = _least_inertia(robot)
        self.limit = np.array(robot.effort_limit)
        self._fastest = np.array(robot.velocity_limit)
        self.position = np.array(position, dtype=float)
        self.speed = np.zeros(len(self.position))
        self.motor = np.zeros(len(self.position))
        self.gear = np.zeros(len(self.position))
        self.peak = np.zeros(len(self.position))
        self.set_time_step(SAMPLE)

    def clear_peak(self) -> None:
        """Begin to measure the largest torques of the gears anew."""
        self.peak = np.zeros(len(self.position))

    def set_time_step(self, step: float) -> None:
        """Set the length of the coming steps [s]."""
        if step == self._step:
            return
        data = self._data
        self._step = step
        # Gears of very light links, as those of the fingers, are stiffer than a step can follow.
        together = 1.0 / (1.0 / self._rotor + 1.0 / self.link_inertia)
        self._stiffness = np.minimum(data.stiffness, together / step**2)
        self._damping = data.damping / (1.0 + step * data.damping / together)
        # Implicit Euler of the servo: it is stable for any gains.
        self._yield = 1.0 / (
            self._rotor + step * data.speed_gain + step**2 * data.position_gain)
        self._per_torque, self._per_speed = step / self._rotor, self._rotor / step

    def torque(self, reference: Array, rate: Array, position: Array, speed: Array) -> Array:
        """Advance the motors by a step; return the torques of the gears on the links, (J,) [N m].

        Args:
            reference: Reference of the motors' angles at the end of the step, (J,) [rad].
            rate: Its rate, (J,) [rad/s].
            position: Positions of the joints at the start of the step, (J,) [rad].
            speed: Their speeds, (J,) [rad/s].
        """
        data, step, angle, turning = self._data, self._step, self.position, self.speed
        gear = self._stiffness * (angle - position) + self._damping * (turning - speed)
        self.peak = np.maximum(self.peak, np.abs(gear))
        wanted = data.position_gain * (reference - angle) + data.speed_gain * rate
        ahead = (self._rotor * turning + step * (wanted - gear)) * self._yield
        motor = self._per_speed * (ahead - turning) + gear
        least, most = -self.limit, self.limit
        if (np.abs(turning) >= self._fastest).any():
            # A motor at its largest speed drives no further; it can only brake.
            least, most = least * (turning > -self._fastest), most * (turning < self._fastest)
        self.gear, self.motor = gear, np.minimum(np.maximum(motor, least), most)
        self.speed = turning + self._per_torque * (self.motor - gear)
        self.position = angle + step * self.speed
        return gear


def _least_inertia(robot: RobotConfig) -> Array:
    """Compute the inertia that each joint shows when all other joints are free, (J,) [kg m^2]."""
    model = free_floating_model(robot)
    data = model.createData()
    upper = np.triu(np.array(pin.crba(model, data, pin.neutral(model))))
    inverse = np.linalg.inv(upper + np.triu(upper, 1).T)
    columns = [model.joints[model.getJointId(name)].idx_v for name in robot.joint_names]
    return np.asarray(1.0 / np.diag(inverse)[columns])
