"""Pull test: the effective mass that point B of the simulated robot shows to a short force."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.errors import SettingError
from hrp2_description.robot import RobotConfig
from numpy.typing import ArrayLike

from hrp2_sim_bridge.physics.pybullet.client import connect, prepare
from hrp2_sim_bridge.physics.pybullet.robot_body import RobotBody
from hrp2_sim_bridge.settings import WorldSettings

_HOLD = 1e6  # torque that a locked joint may carry [N m]
_GRIP = 1e7  # force that may hold a sole on the floor [N]
_ITERATIONS = 2000  # iterations of the solver, which must converge here


@dataclass(frozen=True)
class PullTest:
    """Result of a pull test.

    Attributes:
        impulse: Impulse on point B [N s].
        speed_change: Change of point B's speed along the impulse [m/s].
    """

    impulse: float
    speed_change: float

    @property
    def effective_mass(self) -> float:
        """Effective mass at point B [kg]."""
        return self.impulse / self.speed_change


def pull_test(
    robot: RobotConfig,
    posture: Array,
    *,
    locked: tuple[str, ...],
    direction: ArrayLike = (0.0, -1.0, 0.0),
    impulse: float = 0.1,
    duration: float = 2e-4,
    step: float = 2e-5,
) -> PullTest:
    """Apply a short force at point B of the simulated robot and measure how fast it moves.

    There is no gravity and both soles are fixed to the world, as in the constraints of the
    effective mass `1 / (J M^-1 J^T)`. Joints that are not locked have no drive.

    Args:
        robot: Configuration of the robot.
        posture: Joint angles, (30,) [rad].
        locked: Names of the joints that are locked.
        direction: Direction of the force in the world, (3,).
        impulse: Impulse of the force, small enough to move nothing far [N s].
        duration: Duration of the constant force [s].
        step: Physics step [s].

    Raises:
        SettingError: The force is shorter than a step.
        SimulatorMissingError: PyBullet is not installed.
    """
    if not duration >= step:
        raise SettingError("duration", duration, f"at least a step of {step} s")
    along = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
    force = (along * impulse / duration).tolist()
    client = connect(False)
    try:
        prepare(client, step, _ITERATIONS, WorldSettings.friction)
        client.setGravity(0.0, 0.0, 0.0)
        body = RobotBody(client, robot, posture)
        for name in locked:
            joint = body.joint_index[name]
            client.setJointMotorControl2(
                body.body, joint, client.VELOCITY_CONTROL, targetVelocity=0.0, force=_HOLD
            )
        for sole in body.soles.values():
            state = body.frame(sole)
            grip = client.createConstraint(
                body.body, sole, -1, -1, client.JOINT_FIXED, [0, 0, 0], [0, 0, 0],
                state.position.tolist(), [0, 0, 0, 1], state.quaternion.tolist(),
            )
            client.changeConstraint(grip, maxForce=_GRIP)
        for _ in range(round(duration / step)):
            place = body.contact_sphere().position.tolist()
            client.applyExternalForce(
                body.body, body.contact_link, force, place, client.WORLD_FRAME
            )
            client.stepSimulation()
        moved = float(body.contact_sphere().linear @ along)
    finally:
        client.disconnect()
    return PullTest(impulse, moved)
