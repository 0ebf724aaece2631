from dataclasses import replace

import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from hrp2_description.errors import RobotConfigError
from hrp2_sim_bridge.settings import SensorSettings, WorldSettings


@pytest.fixture(scope="module")
def stood(robot, paper_door):
    """A world on rigid soles that stood for two seconds, its log, and exact sensors' readings."""
    from hrp2_sim_bridge.world import World

    exact = SensorSettings(sensor_noise=False)
    world = World(robot, paper_door, 0.9, -0.42, sole="rigid", sensors=exact)
    samples = [world.step() for _ in range(400)]
    yield world, world.log(), samples
    world.close()


def test_a_robot_that_is_only_planned_for_is_refused_by_what_it_lacks(robot, paper_door):
    """The error names the missing field."""
    from hrp2_sim_bridge.world import World

    with pytest.raises(RobotConfigError, match="drives"):
        World(replace(robot, drives=None), paper_door, 0.9, -0.42)


def test_the_friction_of_soles_and_floor_is_the_one_that_was_asked_for(stood) -> None:
    """The friction of a sole multiplied by that of the floor is the configured one."""
    world = stood[0]
    client, robot = world.engine.client, world.engine.robot
    floor = client.getDynamicsInfo(0, -1)[1]
    for sole in robot.soles.values():
        pair = floor * client.getDynamicsInfo(robot.body, sole)[1]
        assert pair == pytest.approx(WorldSettings.friction)


def test_no_inertia_was_replaced_and_none_is_damped(stood) -> None:
    """PyBullet has replaced no inertia, and no joint is damped."""
    world = stood[0]
    client, body = world.engine.client, world.engine.robot.body
    mass = 0.0
    for link in range(-1, client.getNumJoints(body)):
        info = client.getDynamicsInfo(body, link)
        assert min(info[2]) > 0.0
        mass += info[0]
        if link >= 0:
            assert client.getJointInfo(body, link)[6] == 0.0
    assert mass == pytest.approx(58.0, abs=1e-6)


def test_soles_carry_the_weight_to_half_a_percent(stood, robot) -> None:
    """The soles carry the weight to half a percent."""
    log = stood[1]
    carried = log["left_wrench"][:, 2] + log["right_wrench"][:, 2]
    np.testing.assert_allclose(carried, robot.mass * GRAVITY, rtol=0.005)
    sideways = log["left_wrench"][:, :2] + log["right_wrench"][:, :2]
    assert np.abs(sideways).max() < 0.01 * robot.mass * GRAVITY


def test_half_sitting_holds_for_two_seconds(stood) -> None:
    """Half-sitting is held for two seconds."""
    com = stood[1]["com_position"]
    assert np.linalg.norm(com - com[0], axis=1).max() < 0.002


def test_zmp_of_the_wrenches_lies_under_the_center_of_mass(stood) -> None:
    """The ZMP of the wrenches is below the center of mass."""
    log = stood[1]
    force, moment = np.zeros(3), np.zeros(3)
    for side in ("left", "right"):
        wrench = log[f"{side}_wrench"][-200:].mean(axis=0)
        force += wrench[:3]
        moment += wrench[3:] + np.cross(log[f"{side}_sole_position"][-1], wrench[:3])
    zmp = np.array([-moment[1], moment[0]]) / force[2]
    np.testing.assert_allclose(zmp, log["com_position"][-1, :2], atol=5e-4)


def test_center_of_mass_from_pinocchio_equals_pybullets(stood) -> None:
    """The center of mass by Pinocchio is that of PyBullet."""
    world, log, _ = stood
    client, body = world.engine.client, world.engine.robot.body
    total = client.getDynamicsInfo(body, -1)[0]
    moment = total * np.array(client.getBasePositionAndOrientation(body)[0])
    for link in range(client.getNumJoints(body)):
        mass = client.getDynamicsInfo(body, link)[0]
        moment += mass * np.array(client.getLinkState(body, link)[0])
        total += mass
    np.testing.assert_allclose(log["com_position"][-1], moment / total, atol=2e-5)


def test_imu_feels_gravity_and_no_rotation(stood) -> None:
    """The IMU of a standing robot measures gravity and no rotation."""
    imu = stood[2][-1].imu
    np.testing.assert_allclose(imu.specific_force, [0.0, 0.0, GRAVITY], atol=0.04)
    assert np.abs(imu.angular_velocity).max() < 1e-3
    assert imu.orientation[3] == pytest.approx(1.0, abs=1e-5)


def test_motor_torques_are_those_of_statics_for_the_arms(stood, robot) -> None:
    """The torques of the free arms and the head are those of gravity."""
    import pinocchio as pin

    model = pin.buildModelFromUrdf(str(robot.urdf_path), pin.JointModelFreeFlyer())
    q = pin.neutral(model)
    for name, angle in zip(robot.joint_names, robot.half_sitting, strict=True):
        q[model.joints[model.getJointId(name)].idx_q] = angle
    gravity = pin.computeGeneralizedGravity(model, model.createData(), q)
    for index, name in enumerate(robot.joint_names):
        if "ARM" in name or "HEAD" in name:
            wanted = gravity[model.joints[model.getJointId(name)].idx_v]
            assert stood[2][-1].effort[index] == pytest.approx(wanted, abs=0.05)
