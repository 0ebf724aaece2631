import dataclasses
from types import MappingProxyType

import numpy as np
import pinocchio as pin
import pytest
from hrp2_sim_bridge.errors import ModelError
from hrp2_sim_bridge.physics.pybullet.client import connect, prepare
from hrp2_sim_bridge.physics.pybullet.robot_body import RobotBody
from hrp2_sim_bridge.physics.pybullet.rotors import link_inertias, load_robot


@pytest.fixture
def client():
    """A client with an empty world."""
    client = connect(False)
    prepare(client, 0.0005, 50, 0.8)
    yield client
    client.disconnect()


def struck_speeds(client, robot, scale, posture, joint):
    """Return the speeds (30,) of a floating robot's joints after an impulse of 1 N m s at one."""
    body = load_robot(client, robot, scale)
    count = client.getNumJoints(body)
    indices = {client.getJointInfo(body, i)[1].decode(): i for i in range(count)}
    for name, angle in zip(robot.joint_names, posture, strict=True):
        client.resetJointState(body, indices[name], angle)
        client.setJointMotorControl2(body, indices[name], client.VELOCITY_CONTROL, force=0.0)
    client.setGravity(0.0, 0.0, 0.0)
    client.resetBasePositionAndOrientation(body, [0.0, 0.0, 5.0], [0.0, 0.0, 0.0, 1.0])
    client.setTimeStep(1e-6)
    client.setJointMotorControl2(body, indices[joint], client.TORQUE_CONTROL, force=1e4)
    client.stepSimulation()
    return 100.0 * np.array(
        [client.getJointState(body, indices[name])[1] for name in robot.joint_names]
    )


def pinocchio_matrix(robot, scale, posture):
    """Return Pinocchio's mass matrix (36, 36) with `link_inertias`, and the joints' columns."""
    model = pin.buildModelFromUrdf(str(robot.urdf_path), pin.JointModelFreeFlyer())
    bare, full = link_inertias(robot, 0.0), link_inertias(robot, scale)
    for name, inertia in full.items():
        joint = model.frames[model.getFrameId(name)].parentJoint
        body = model.inertias[joint]
        # The links' axes are parallel to those of the joint that moves them.
        model.inertias[joint] = pin.Inertia(
            body.mass, body.lever, body.inertia + inertia - bare[name]
        )
    q = pin.neutral(model)
    joints = [model.joints[model.getJointId(name)] for name in robot.joint_names]
    q[[joint.idx_q for joint in joints]] = posture
    columns = [joint.idx_v for joint in joints]
    upper = np.triu(pin.crba(model, model.createData(), q))
    return upper + np.triu(upper, 1).T, columns


@pytest.mark.parametrize("joint", ["RLEG_JOINT1", "LLEG_JOINT5", "RARM_JOINT1", "RARM_JOINT5"])
@pytest.mark.parametrize("scale", [0.0, 1.0, 3.0])
def test_struck_joint_moves_as_the_mass_matrix_with_rotors_says(
    client, robot, scale, joint
) -> None:
    """PyBullet accepts inertias that violate the triangle inequality, with their products."""
    posture = robot.posture(robot.braced_posture)
    matrix, columns = pinocchio_matrix(robot, scale, posture)
    wanted = np.linalg.inv(matrix)[np.ix_(columns, columns)][:, robot.index(joint)]
    simulated = struck_speeds(client, robot, scale, posture, joint)
    np.testing.assert_allclose(simulated, wanted, atol=2e-3 * np.abs(wanted).max())


def test_a_rotor_weighs_on_its_joint_as_gear_squared(robot) -> None:
    """Rotors add at least gear^2 J to the joint's own entry of the mass matrix."""
    bare, columns = pinocchio_matrix(robot, 0.0, robot.half_sitting)
    full, _ = pinocchio_matrix(robot, 1.0, robot.half_sitting)
    for index, name in enumerate(robot.joint_names):
        gained = (full - bare)[columns[index], columns[index]]
        if robot.rotor_link.get(name) == "child":
            assert gained >= robot.armature[index] - 1e-9
        if name not in robot.rotor_link and "HEAD" in name:
            assert gained == pytest.approx(0.0, abs=1e-9)


def test_rotors_add_inertia_and_no_mass(client, robot) -> None:
    """The robot's mass remains 58 kg with rotors."""
    body = load_robot(client, robot, 1.0)
    masses = [client.getDynamicsInfo(body, i)[0] for i in range(-1, client.getNumJoints(body))]
    assert sum(masses) == pytest.approx(58.0, abs=1e-6)


def test_inertia_that_pybullet_replaced_is_found(client, robot, monkeypatch) -> None:
    """An inertia that PyBullet replaced while loading is an error."""
    change = client.changeDynamics
    monkeypatch.setattr(client, "changeDynamics", lambda *_, **__: None, raising=False)
    with pytest.raises(ModelError) as error:
        load_robot(client, robot, 1.0)
    assert error.value.value != error.value.limit
    monkeypatch.setattr(client, "changeDynamics", change, raising=False)


def test_wrong_total_mass_is_found(client, robot) -> None:
    """A configuration with another mass than the URDF is an error with both values."""
    with pytest.raises(ModelError, match="mass") as error:
        load_robot(client, dataclasses.replace(robot, mass=60.0), 0.0)
    assert error.value.limit == 60.0


def test_rotors_may_be_on_no_link(robot) -> None:
    """An empty rotor_link leaves every inertia unchanged."""
    none = dataclasses.replace(robot, rotor_link=MappingProxyType({}))
    for name, inertia in link_inertias(none, 1.0).items():
        np.testing.assert_array_equal(inertia, link_inertias(robot, 0.0)[name])


def shown_mass(client, body, direction):
    """Return the mass at point B of a floating robot with held joints, for 0.1 N s [kg]."""
    client.setGravity(0.0, 0.0, 0.0)
    client.setTimeStep(2e-5)
    for joint in body.joint_index.values():
        if client.getJointInfo(body.body, joint)[2] != client.JOINT_FIXED:
            client.setJointMotorControl2(
                body.body, joint, client.VELOCITY_CONTROL, targetVelocity=0.0, force=1e6)
    for _ in range(10):
        place = body.contact_sphere().position.tolist()
        client.applyExternalForce(
            body.body, body.contact_link, (500.0 * direction).tolist(), place, client.WORLD_FRAME)
        client.stepSimulation()
    return 0.1 / float(body.contact_sphere().linear @ direction)


def rigid_mass(robot, posture, direction):
    """Return the mass at point B of one rigid body without rotors, by Pinocchio [kg]."""
    matrix, _ = pinocchio_matrix(robot, 0.0, posture)
    model = pin.buildModelFromUrdf(str(robot.urdf_path), pin.JointModelFreeFlyer())
    data, q = model.createData(), pin.neutral(model)
    q[[model.joints[model.getJointId(name)].idx_q for name in robot.joint_names]] = posture
    frame = model.getFrameId(robot.contact_link)
    jacobian = pin.computeFrameJacobian(model, data, q, frame, pin.LOCAL_WORLD_ALIGNED)
    row = direction @ jacobian[:3, :6]
    return 1.0 / float(row @ np.linalg.solve(matrix[:6, :6], row))


@pytest.mark.parametrize("direction", [(0.0, -1.0, 0.0), (1.0, 0.0, 0.0)])
def test_a_robot_with_held_rotors_is_struck_as_one_rigid_body(client, robot, direction) -> None:
    """Point B shows the mass of a rigid body to 0.2 %; rotors on the links would add 2 and 17 %."""
    posture, along = robot.posture(robot.braced_posture), np.array(direction)
    body = RobotBody(client, robot, posture, rotor_scale=1.0)
    body.hold_rotors(True)
    assert shown_mass(client, body, along) == pytest.approx(
        rigid_mass(robot, posture, along), rel=0.002)


def test_letting_rotors_go_gives_back_every_inertia_exactly(client, robot) -> None:
    """After a brace every link has its inertia of before, bit for bit; during it, another one."""
    body = RobotBody(client, robot, robot.half_sitting, rotor_scale=1.0)

    def links():
        count = client.getNumJoints(body.body)
        return [client.getDynamicsInfo(body.body, index) for index in range(-1, count)]

    loaded = links()
    body.hold_rotors(True)
    held = links()
    body.hold_rotors(False)
    assert held != loaded
    assert links() == loaded
