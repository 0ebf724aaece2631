"""Joint encoders, foot force sensors, and all sensors together in the simulation."""

import math

import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from hrp2_description.robot import load_robot_config
from hrp2_sim_bridge.sensors.sensors import ForceSensors, JointEncoders
from hrp2_sim_bridge.settings import SensorSettings
from hrp2_sim_bridge.world import World
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

ROBOT = load_robot_config()
STEP = ROBOT.joint_resolution
POSTURES = arrays(float, 30, elements=st.floats(-3.0, 3.0))
EXACT = SensorSettings(sensor_noise=False)


@given(POSTURES)
def test_joint_angles_come_in_whole_counts_of_the_motor(position):
    """Each joint angle is a whole count, with an error of at most half a count."""
    read, _ = JointEncoders(STEP, np.zeros(30)).read(position)
    counts = read / math.tau * ROBOT.drives.gear_ratio * 2000
    np.testing.assert_allclose(counts, np.rint(counts), atol=1e-6)
    assert np.all(np.abs(read - position) <= 0.5001 * STEP)


def test_noise_of_a_tick_is_that_of_the_mean_of_five_samples():
    """The noise of a tick is 1 N and 0.03 N m divided by the root of five."""
    random = np.random.default_rng(3)
    sensors = ForceSensors(SensorSettings(), random)
    read = np.array([sensors.read(np.zeros((2, 6)), n) for n in random.normal(size=(8000, 2, 6))])
    wanted = np.array([1.0] * 3 + [0.03] * 3) / math.sqrt(5.0)
    np.testing.assert_allclose(read.std(axis=0), [wanted, wanted], rtol=0.04)


@pytest.fixture(scope="module")
def stood(paper_door):
    """Samples and log of half a second on rigid soles: default, exact and uncalibrated sensors.

    On rubber the stabilizer moves the robot by what the sensors say.
    """
    runs = []
    for sensors in (SensorSettings(), EXACT, SensorSettings(force_sensor_calibrated=False)):
        world = World(ROBOT, paper_door, 0.9, -0.42, sole="rigid", sensors=sensors)
        runs.append(([world.step() for _ in range(100)], world.log()))
        world.close()
    return runs


def test_calibrated_feet_carry_the_weight_and_others_show_their_bias(stood):
    """Calibrated feet carry the weight to 0.5 % in every tick; others show a constant bias."""
    weight = ROBOT.mass * GRAVITY
    carried = [[sample.left_wrench[2] + sample.right_wrench[2] for sample in samples]
               for samples, _ in stood]
    np.testing.assert_allclose(carried[:2], weight, rtol=0.005)
    assert np.abs(np.mean(carried[2]) - weight) > 1.0
    assert np.std(carried[2]) < 1.0


def test_exact_sensors_tell_the_truth(make_world, sway, moving):
    """Without noise, joints, wrenches and attitude are the simulator's true ones in a motion."""
    world = make_world(sensors=EXACT)
    postures = np.array([sway(0.0), sway(0.03)])
    world.follow(moving(np.array([0.05, 0.4]), postures), 0.0)
    for _ in range(40):
        sample = world.step()
        position, velocity, effort = world.joints.motors
        np.testing.assert_array_equal(sample.position, position)
        np.testing.assert_array_equal(sample.velocity, velocity)
        np.testing.assert_array_equal(sample.effort, effort)
        np.testing.assert_allclose(
            sample.imu.orientation, world.imu_state.quaternion, atol=1e-7)
    log = world.log()
    np.testing.assert_allclose(sample.left_wrench, log["left_wrench"][-5:].mean(axis=0), atol=0.05)
    assert np.abs(velocity).max() > 0.1


def test_the_truth_does_not_depend_on_the_sensors(stood):
    """The logs of runs with and without noise are the same, bit for bit."""
    noisy, exact = stood[0][1], stood[1][1]
    for name in exact.keys() - {"settings"}:
        column = exact[name]
        np.testing.assert_array_equal(noisy[name], column, err_msg=name)
