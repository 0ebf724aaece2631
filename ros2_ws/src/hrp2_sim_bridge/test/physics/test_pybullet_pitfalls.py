"""Tests that PyBullet's unwanted defaults have no effect (docs/physics.md)."""

import dataclasses
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from hrp2_sim_bridge.errors import ModelError
from hrp2_sim_bridge.physics.pybullet.client import connect, prepare
from hrp2_sim_bridge.physics.pybullet.robot import load_robot


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
        load_robot(client, dataclasses.replace(robot, urdf_path=path), None)
    assert error.value.value != error.value.limit


def test_a_wrong_total_mass_is_found(client, robot) -> None:
    """A configuration with another mass than the URDF is an error with both values."""
    with pytest.raises(ModelError, match="mass") as error:
        load_robot(client, dataclasses.replace(robot, mass=60.0), None)
    assert error.value.limit == 60.0


def test_nothing_slows_a_fall_or_a_joint(client, robot) -> None:
    """PyBullet's default would damp both by 4 % a second."""
    body = load_robot(client, robot, None)
    client.resetBasePositionAndOrientation(body, [0.0, 0.0, 5.0], [0.0, 0.0, 0.0, 1.0])
    for _ in range(600):
        client.stepSimulation()
    assert client.getBaseVelocity(body)[0][2] == pytest.approx(-GRAVITY * 0.3, rel=1e-6)
    client.setGravity(0.0, 0.0, 0.0)
    joint = next(index for index in range(client.getNumJoints(body))
                 if client.getJointInfo(body, index)[1] == b"LARM_JOINT6")
    client.resetJointState(body, joint, 0.0, 1.0)
    before = client.getJointState(body, joint)[1]
    for _ in range(200):
        client.stepSimulation()
    assert client.getJointState(body, joint)[1] == pytest.approx(before, rel=0.02)


@pytest.mark.nightly("two seconds of simulated time")
def test_servo_on_its_limit_pumps_no_force(make_world, robot, moving) -> None:
    """Joints that are held at the URDF's limits need no more torque than gravity requires."""
    world = make_world(sole="rigid")  # on rubber the whole body sways a little
    ends = {"LARM_JOINT2": "upper", "LARM_JOINT4": "lower", "HEAD_JOINT0": "upper"}
    posture = robot.posture(
        {name: getattr(robot, end)[robot.index(name)] for name, end in ends.items()})
    world.follow(moving(np.array([0.05, 1.5]), np.array([robot.half_sitting, posture])), 0.0)
    for _ in range(400):
        sample = world.step()
    torque = world.log()["tick_peak_torque"][-50:]
    for name in ends:
        index = robot.index(name)
        assert sample.position[index] == pytest.approx(posture[index], abs=5e-3)
        assert torque[:, index].max() < 0.1 * robot.effort_limit[index]
        assert np.ptp(torque[:, index]) < 0.1
