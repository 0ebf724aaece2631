"""Centre of mass of a logged motion, computed by Pinocchio from the same URDF."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from hrp2_description.robot import RobotConfig
from humanoid_motion.pinocchio_model import free_floating_model, joint_columns

from hrp2_sim_bridge.physics.frames import rotation


class CenterOfMass:
    """Computes position and velocity of the CoM from the states of base and joints.

    Args:
        robot: Configuration of the robot, whose URDF is the model.
    """

    def __init__(self, robot: RobotConfig) -> None:
        self._model = free_floating_model(robot)
        self._data = self._model.createData()
        self._q_columns, self._v_columns = joint_columns(self._model, robot.joint_names)

    def series(
        self, position: Array, quaternion: Array, linear: Array, angular: Array, q: Array, dq: Array
    ) -> tuple[Array, Array]:
        """Compute the CoM of T samples; all vectors are in the world.

        Args:
            position: Positions of base_link, (T, 3) [m].
            quaternion: Orientations x, y, z, w of base_link, (T, 4).
            linear: Velocities of base_link's origin, (T, 3) [m/s].
            angular: Angular velocities of base_link, (T, 3) [rad/s].
            q: Joint positions, (T, 30) [rad].
            dq: Joint velocities, (T, 30) [rad/s].

        Returns:
            Positions (T, 3) [m] and velocities (T, 3) [m/s] of the CoM.
        """
        turn = rotation(quaternion)
        full_q = np.zeros((len(q), self._model.nq))
        full_v = np.zeros((len(q), self._model.nv))
        full_q[:, :3], full_q[:, 3:7] = position, quaternion
        # Pinocchio expresses the base's velocity in the base's own frame.
        full_v[:, :3] = np.einsum("tji,tj->ti", turn, linear)
        full_v[:, 3:6] = np.einsum("tji,tj->ti", turn, angular)
        full_q[:, self._q_columns] = q
        full_v[:, self._v_columns] = dq
        com = np.zeros((len(q), 3))
        velocity = np.zeros((len(q), 3))
        for row in range(len(q)):
            pin.centerOfMass(self._model, self._data, full_q[row], full_v[row])
            com[row], velocity[row] = self._data.com[0], self._data.vcom[0]
        return com, velocity
