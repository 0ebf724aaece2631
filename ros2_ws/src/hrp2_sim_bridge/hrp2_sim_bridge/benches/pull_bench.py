"""Pull test: the effective mass that point B of the simulated robot shows to a short force."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.errors import SettingError
from hrp2_description.robot import SIDES, RobotConfig
from numpy.typing import ArrayLike

from hrp2_sim_bridge.physics.mujoco.library import load_mujoco
from hrp2_sim_bridge.physics.mujoco.model import WORLD, compile_model, robot_spec
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
    engine: str = WorldSettings.engine,
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
        engine: Name of the physics engine.

    Raises:
        SettingError: The force is shorter than a step.
        SimulatorMissingError: The engine is not installed.
    """
    if not duration >= step:
        raise SettingError("duration", duration, f"at least a step of {step} s")
    along = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
    run = {"pybullet": _in_pybullet, "mujoco": _in_mujoco}[engine]
    force = along * impulse / duration
    speed = run(robot, posture, locked, force, round(duration / step), step)
    return PullTest(impulse, float(speed @ along))


def _in_pybullet(
    robot: RobotConfig, posture: Array, locked: tuple[str, ...], force: Array, steps: int,
    step: float,
) -> Array:
    """Return the velocity of point B after some steps under a force in the world, (3,) [m/s]."""
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
        for _ in range(steps):
            place = body.contact_sphere().position.tolist()
            client.applyExternalForce(
                body.body, body.contact_link, force.tolist(), place, client.WORLD_FRAME
            )
            client.stepSimulation()
        return body.contact_sphere().linear
    finally:
        client.disconnect()


def _in_mujoco(
    robot: RobotConfig, posture: Array, locked: tuple[str, ...], force: Array, steps: int,
    step: float,
) -> Array:
    """Return the velocity of point B after some steps under a force in the world, (3,) [m/s]."""
    mujoco = load_mujoco()
    spec = robot_spec(mujoco, robot, _ITERATIONS, visible=False)
    spec.option.gravity = [0.0, 0.0, 0.0]
    soles = [robot.feet[side].sole for side in SIDES]
    for sole in soles:
        spec.add_equality(
            name=sole, name1=WORLD, name2=sole, type=mujoco.mjtEq.mjEQ_WELD,
            objtype=mujoco.mjtObj.mjOBJ_BODY,
        )
    model = compile_model(spec, [], step).raw
    data = mujoco.MjData(model)
    for name, angle in zip(robot.joint_names, posture, strict=True):
        data.joint(name).qpos[0] = angle
        hold = model.equality(name)
        hold.data[0] = angle
        data.eq_active[hold.id] = name in locked
    mujoco.mj_forward(model, data)
    for sole in soles:
        pose = data.body(sole)
        # Pose of the sole in the world, after the anchor, which is the sole's origin.
        model.equality(sole).data[:10] = [0.0, 0.0, 0.0, *pose.xpos, *pose.xquat]
    elbow = model.body(robot.contact_link).id
    jacobian = np.zeros((3, model.nv))
    for _ in range(steps):
        mujoco.mj_jac(model, data, jacobian, None, data.xpos[elbow], elbow)
        data.qfrc_applied[:] = force @ jacobian
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    mujoco.mj_jac(model, data, jacobian, None, data.xpos[elbow], elbow)
    return np.asarray(jacobian @ data.qvel)
