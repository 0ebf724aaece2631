"""Centre of mass of a logged motion, by Pinocchio from the same URDF."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import RobotConfig

from hrp2_sim_bridge.physics.frames import rotation


class CenterOfMass:
    """CoM position and velocity from base state and joint states.

    Args:
        robot: configuration; its URDF is the model.
    """

    def __init__(self, robot: RobotConfig) -> None:
        import pinocchio

        self._pin = pinocchio
        self._model = pinocchio.buildModelFromUrdf(
            str(Path(robot.urdf_path)), pinocchio.JointModelFreeFlyer()
        )
        self._data = self._model.createData()
        joints = [self._model.joints[self._model.getJointId(n)] for n in robot.joint_names]
        self._q_columns = np.array([joint.idx_q for joint in joints])
        self._v_columns = np.array([joint.idx_v for joint in joints])

    def series(
        self, position: Array, quaternion: Array, linear: Array, angular: Array, q: Array, dq: Array
    ) -> tuple[Array, Array]:
        """CoM of T samples.

        Args:
            position: (T, 3) of base_link in the world [m].
            quaternion: (T, 4) x, y, z, w.
            linear: (T, 3) velocity of base_link's origin in the world [m/s].
            angular: (T, 3) in the world [rad/s].
            q: (T, 30) [rad].
            dq: (T, 30) [rad/s].

        Returns:
            positions (T, 3) [m] and velocities (T, 3) [m/s] in the world.
        """
        turn = rotation(quaternion)
        full_q = np.zeros((len(q), self._model.nq))
        full_v = np.zeros((len(q), self._model.nv))
        full_q[:, :3], full_q[:, 3:7] = position, quaternion
        # The free flyer's velocity is in the body's own frame.
        full_v[:, :3] = np.einsum("tji,tj->ti", turn, linear)
        full_v[:, 3:6] = np.einsum("tji,tj->ti", turn, angular)
        full_q[:, self._q_columns] = q
        full_v[:, self._v_columns] = dq
        com = np.zeros((len(q), 3))
        velocity = np.zeros((len(q), 3))
        for row in range(len(q)):
            self._pin.centerOfMass(self._model, self._data, full_q[row], full_v[row])
            com[row], velocity[row] = self._data.com[0], self._data.vcom[0]
        return com, velocity
