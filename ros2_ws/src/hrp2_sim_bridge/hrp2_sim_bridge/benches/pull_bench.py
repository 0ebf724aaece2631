"""Pull test: the effective mass that point B of the simulated robot shows to a short force."""

from __future__ import annotations

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.errors import SettingError
from door_model.door.config import load_door
from hrp2_description.robot import SIDES, RobotConfig

from hrp2_sim_bridge.physics.contact import design_leaf
from hrp2_sim_bridge.physics.engine import Scene, require_simulable
from hrp2_sim_bridge.physics.mujoco.engine import load_mujoco
from hrp2_sim_bridge.physics.mujoco.model import WORLD, compile_model, robot_spec
from hrp2_sim_bridge.physics.pybullet.engine import PyBulletEngine
from hrp2_sim_bridge.settings import FARTHEST, WorldSettings

_GRIP = 1e7  # force that may hold a sole on the floor [N]
_ITERATIONS = 2000  # iterations of the solver, which must converge here
_PUSH = np.array([0.0, -1.0, 0.0])  # direction of the force in the world
_IMPULSE = 0.1  # small enough to move nothing far [N s]
_STEP = 2e-5  # physics step [s]


def pull_test(
    robot: RobotConfig, posture: Array, *, locked: tuple[str, ...], duration: float = 2e-4,
    engine: str = WorldSettings.engine,
) -> float:
    """Apply a short force at point B of the simulated robot and measure how fast it moves.

    There is no gravity and both soles are fixed to the world, as in the constraints of the
    effective mass `1 / (J M^-1 J^T)`. Joints that are not locked have no drive.

    Args:
        robot: Configuration of the robot.
        posture: Joint angles, (J,) [rad].
        locked: Names of the joints that are locked.
        duration: Duration of the constant force [s].
        engine: Name of the physics engine.

    Returns:
        Impulse over change of point B's speed, the effective mass [kg].

    Raises:
        SettingError: The force is shorter than a step.
        SimulatorMissingError: The engine is not installed.
    """
    if not duration >= _STEP:
        raise SettingError("duration", duration, f"at least a step of {_STEP} s")
    run = {"pybullet": _in_pybullet, "mujoco": _in_mujoco}[engine]
    force = _PUSH * _IMPULSE / duration
    return _IMPULSE / float(run(robot, posture, locked, force, round(duration / _STEP)) @ _PUSH)


def _in_pybullet(
    robot: RobotConfig, posture: Array, locked: tuple[str, ...], force: Array, steps: int
) -> Array:
    """Return the velocity of point B after some steps under a force in the world, (3,) [m/s]."""
    settings = WorldSettings(sole="rigid", iterations=_ITERATIONS, time_step_coarse=_STEP)
    door, engine = load_door("paper"), PyBulletEngine()
    engine.reset(Scene(
        require_simulable(robot, settings), posture, door, FARTHEST, -1.0,
        design_leaf(door, -1.0, settings), settings))
    client, body = engine.client, engine.body
    try:
        client.setGravity(0.0, 0.0, 0.0)
        engine.hold([robot.index(name) for name in locked])
        for side in SIDES:
            sole = engine.link_names.index(robot.feet[side].sole)
            place, turn = client.getLinkState(body, sole, 0, 1)[4:6]
            grip = client.createConstraint(
                body, sole, -1, -1, client.JOINT_FIXED, [0, 0, 0], [0, 0, 0], place, [0, 0, 0, 1],
                turn)
            client.changeConstraint(grip, maxForce=_GRIP)
        elbow = engine.link_names.index(robot.contact_link)
        for _ in range(steps):
            place = client.getLinkState(body, elbow, 0, 1)[4]
            client.applyExternalForce(body, elbow, force.tolist(), place, client.WORLD_FRAME)
            client.stepSimulation()
        com, _, _, _, place, _, linear, angular = client.getLinkState(body, elbow, 1, 1)
        return np.asarray(np.add(linear, np.cross(angular, np.subtract(place, com))))
    finally:
        engine.close()


def _in_mujoco(
    robot: RobotConfig, posture: Array, locked: tuple[str, ...], force: Array, steps: int
) -> Array:
    """Return the velocity of point B after some steps under a force in the world, (3,) [m/s]."""
    mujoco = load_mujoco()
    spec = robot_spec(mujoco, robot, _ITERATIONS, visible=False)
    spec.option.gravity = [0.0, 0.0, 0.0]
    soles = [robot.feet[side].sole for side in SIDES]
    for sole in soles:
        spec.add_equality(
            name=sole, name1=WORLD, name2=sole, type=mujoco.mjtEq.mjEQ_WELD,
            objtype=mujoco.mjtObj.mjOBJ_BODY)
    model = compile_model(spec, [], _STEP).raw
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
