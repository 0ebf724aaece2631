"""Tests that PyBullet's unwanted defaults have no effect (docs/physics.md)."""

import dataclasses
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from hrp2_sim_bridge.errors import ModelError
from hrp2_sim_bridge.physics.pybullet.client import connect, prepare
from hrp2_sim_bridge.physics.pybullet.robot_body import RobotBody
from hrp2_sim_bridge.physics.pybullet.urdf import load_robot


@pytest.fixture
def lifted(robot):
    """The client, and the robot in half-sitting 5 m above the floor with its motors off."""
    client = connect(False)
    prepare(client, 0.0005, 50, 0.8)
    body = RobotBody(client, robot, robot.half_sitting)
    position, turn = client.getBasePositionAndOrientation(body.body)
    client.resetBasePositionAndOrientation(body.body, np.add(position, [0, 0, 5.0]), turn)
    for index in range(client.getNumJoints(body.body)):
        client.setJointMotorControl2(body.body, index, client.VELOCITY_CONTROL, force=0.0)
    yield client, body
    client.disconnect()


@pytest.fixture
def client():
    """A client with an empty world."""
    client = connect(False)
    prepare(client, 0.0005, 20, 0.8)
    yield client
    client.disconnect()


def test_an_inertia_that_pybullet_replaced_is_found(client, robot, tmp_path) -> None:
    """A link that is easier to turn about two axes than it can be about the third is an error."""
    tree = ET.parse(robot.urdf_path)
    link = tree.find(".//link[@name='torso']/inertial/inertia")
    link.attrib.update(ixx="1.0", iyy="0.1", izz="0.1", ixy="0", ixz="0", iyz="0")
    path = tmp_path / "robot.urdf"
    tree.write(path)
    with pytest.raises(ModelError, match="torso") as error:
        load_robot(client, dataclasses.replace(robot, urdf_path=path))
    assert error.value.value != error.value.limit


def test_a_wrong_total_mass_is_found(client, robot) -> None:
    """A configuration with another mass than the URDF is an error with both values."""
    with pytest.raises(ModelError, match="mass") as error:
        load_robot(client, dataclasses.replace(robot, mass=60.0))
    assert error.value.limit == 60.0


def test_nothing_slows_a_fall(lifted) -> None:
    """A fall is not damped, as PyBullet's default would by 4 % per second."""
    client, body = lifted
    for _ in range(600):
        client.stepSimulation()
    fallen = client.getBaseVelocity(body.body)[0][2]
    assert fallen == pytest.approx(-GRAVITY * 0.3, rel=1e-6)


def test_nothing_slows_a_joint(lifted) -> None:
    """A wrist that turns in free fall keeps its speed."""
    client, body = lifted
    client.setGravity(0.0, 0.0, 0.0)
    joint = body.joint_index["LARM_JOINT6"]
    client.resetJointState(body.body, joint, 0.0, 1.0)
    before = client.getJointState(body.body, joint)[1]
    for _ in range(200):
        client.stepSimulation()
    assert client.getJointState(body.body, joint)[1] == pytest.approx(before, rel=0.02)


@pytest.mark.nightly("two seconds of simulated time")
def test_servo_on_its_limit_pumps_no_force(make_world, robot, moving) -> None:
    """Joints that are held at the URDF's limits need no more torque than gravity requires."""
    world = make_world(sole="rigid")  # on rubber the whole body sways a little
    ends = {"LARM_JOINT2": "upper", "LARM_JOINT4": "lower", "HEAD_JOINT0": "upper"}
    posture = robot.posture(
        {name: getattr(robot, end)[robot.index(name)] for name, end in ends.items()}
    )
    world.follow(moving(np.array([0.05, 1.5]), np.array([robot.half_sitting, posture])), 0.0)
    for _ in range(400):
        sample = world.step()
    torque = world.log(with_com=False)["tick_peak_torque"][-50:]
    for name in ends:
        index = robot.index(name)
        assert sample.position[index] == pytest.approx(posture[index], abs=5e-3)
        assert torque[:, index].max() < 0.1 * robot.effort_limit[index]
        assert np.ptp(torque[:, index]) < 0.1
