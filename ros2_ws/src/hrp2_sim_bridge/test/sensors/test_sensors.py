"""Tests of joint encoders, foot force sensors, and all sensors together in the simulation."""

import dataclasses
import math

import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from door_impact_common.errors import SettingError
from hrp2_description.robot import load_robot_config
from hrp2_sim_bridge.sensors.sensors import ForceSensors, JointEncoders
from hrp2_sim_bridge.settings import TICK, SensorSettings
from humanoid_motion.kinematics import RobotKinematics
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from zmp_publisher.odometry import FootOdometry
from zmp_publisher.zmp_estimator import ZmpEstimator

ROBOT = load_robot_config()
STEP = ROBOT.joint_resolution
POSTURES = arrays(float, 30, elements=st.floats(-3.0, 3.0))
EXACT = SensorSettings(sensor_noise=False)


def flat(sample):
    """Return all numbers of a tick's sample."""
    fields = dataclasses.asdict(sample)
    return np.concatenate([np.ravel(v) for v in (*fields.pop("imu").values(), *fields.values())])


@given(POSTURES)
def test_joint_angles_come_in_whole_counts_of_the_motor(position):
    """Each joint angle is a whole count, with an error of at most half a count."""
    read, _ = JointEncoders(STEP, np.zeros(30)).read(position)
    counts = read / math.tau * ROBOT.drives.gear_ratio * 2000
    np.testing.assert_allclose(counts, np.rint(counts), atol=1e-6)
    assert np.all(np.abs(read - position) <= 0.5001 * STEP)


@given(POSTURES, POSTURES)
def test_velocity_is_the_mean_speed_over_the_tick(before, after):
    """The velocity is the displacement over the duration, in whole counts per tick."""
    encoders = JointEncoders(STEP, np.zeros(30))
    encoders.read(before)
    _, velocity = encoders.read(after)
    counts = velocity * TICK / STEP
    np.testing.assert_allclose(counts, np.rint(counts), atol=1e-6)
    assert np.all(np.abs(velocity - (after - before) / TICK) <= 1.0001 * STEP / TICK)


def test_noise_of_a_tick_is_that_of_the_mean_of_five_samples():
    """The noise of a tick is 1 N and 0.03 N m divided by the root of five."""
    random = np.random.default_rng(3)
    sensors = ForceSensors(SensorSettings(), random)
    read = np.array([sensors.read(np.zeros((2, 6)), n) for n in random.normal(size=(8000, 2, 6))])
    wanted = np.array([1.0] * 3 + [0.03] * 3) / math.sqrt(5.0)
    np.testing.assert_allclose(read.std(axis=0), [wanted, wanted], rtol=0.04)


@pytest.fixture(scope="module")
def stand(paper_door):
    """A function: half a second of samples, the world's log and the ZMPs (100, 2).

    On rigid soles: on rubber the stabilizer moves the robot by what the sensors say.
    """
    from hrp2_sim_bridge.world import World

    def run(**settings):
        world = World(ROBOT, paper_door, 0.9, -0.42, sole="rigid", **settings)
        samples = [world.step() for _ in range(100)]
        log = world.log()
        world.close()
        odometry = FootOdometry(RobotKinematics(ROBOT), loaded_force=0.05 * ROBOT.mass * GRAVITY)
        zmp = ZmpEstimator(ROBOT.mass * GRAVITY, ROBOT.soles)
        points = []
        for tick in samples:
            wrenches = {"left": tick.left_wrench, "right": tick.right_wrench}
            pose = odometry.update(tick.position, {s: row[2] for s, row in wrenches.items()})
            points.append(zmp.read(pose.soles, wrenches).point)
        return samples, log, np.array(points)

    return run


@pytest.fixture(scope="module")
def stood(stand):
    """Standing with the default sensors and with exact ones."""
    return stand(), stand(sensors=EXACT)


def test_noisy_soles_carry_the_weight_to_half_a_percent(stood):
    """In every tick the calibrated sensors show the weight to half a percent."""
    carried = [sample.left_wrench[2] + sample.right_wrench[2] for sample in stood[0][0]]
    np.testing.assert_allclose(carried, ROBOT.mass * GRAVITY, rtol=0.005)


def test_calibrated_zmp_is_right_to_half_a_millimetre_and_not_exact(stood):
    """The noise moves the ZMP of a standing robot by about 0.1 mm."""
    error = stood[0][2] - stood[1][2]
    assert 2e-5 < np.sqrt(np.mean(error**2)) < 2e-4
    assert np.abs(error).max() < 5e-4


def test_uncalibrated_bias_shows_in_the_zmp(stand, stood):
    """The ZMP is shifted by the moments of the biases divided by the normal force."""
    settings = SensorSettings(force_sensor_calibrated=False)
    samples, log, points = stand(sensors=settings)
    shift = points.mean(axis=0) - stood[1][2].mean(axis=0)
    noise_of_mean = 1.5e-4 / math.sqrt(len(points))
    assert np.linalg.norm(shift) > 10.0 * noise_of_mean
    bias = np.mean([[s.left_wrench, s.right_wrench] for s in samples], axis=0)
    bias -= [log[f"{side}_wrench"].mean(axis=0) for side in ("left", "right")]
    normal = ROBOT.mass * GRAVITY + bias[:, 2].sum()
    soles = np.array([log[f"{side}_sole_position"][-1] for side in ("left", "right")])
    point = stood[1][2].mean(axis=0)
    levers = soles[:, :2] - point
    wanted_x = (levers[:, 0] @ bias[:, 2] - bias[:, 4].sum()) / normal
    wanted_y = (levers[:, 1] @ bias[:, 2] + bias[:, 3].sum()) / normal
    np.testing.assert_allclose(shift, [wanted_x, wanted_y], atol=5e-5)


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
            sample.imu.orientation, world.imu_state.quaternion, atol=1e-7
        )
    log = world.log(with_com=False)
    np.testing.assert_allclose(sample.left_wrench, log["left_wrench"][-5:].mean(axis=0), atol=0.05)
    assert np.abs(velocity).max() > 0.1


def test_the_truth_does_not_depend_on_the_sensors(stood):
    """The logs of runs with and without noise are the same, bit for bit."""
    noisy, exact = stood[0][1], stood[1][1]
    for name in exact.keys() - {"settings"}:
        column = exact[name]
        np.testing.assert_array_equal(noisy[name], column, err_msg=name)


def test_the_same_seed_reads_the_same_and_another_one_does_not(make_world):
    """Two worlds of one seed have the same readings, a world of another seed has others."""
    first, second, other = (make_world(seed=seed, sole="rigid").step() for seed in (7, 7, 8))
    np.testing.assert_array_equal(flat(first), flat(second))
    assert np.all(first.left_wrench != other.left_wrench)
    assert np.all(first.imu.specific_force != other.imu.specific_force)
    assert np.all(first.imu.angular_velocity != other.imu.angular_velocity)


@pytest.mark.parametrize(
    ("name", "value"),
    [("torque_noise", math.nan), ("force_calibration_samples", 0), ("sensor_noise", 1)],
)
def test_sensors_that_cannot_be_are_refused(name, value):
    """The error names the setting and its value."""
    with pytest.raises(SettingError) as error:
        SensorSettings(**{name: value})
    assert error.value.setting == name
    assert str(value) in str(error.value)
