"""Tests of the IMU and of the attitude that is estimated from it."""

import math
from itertools import pairwise

import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from hrp2_sim_bridge.physics.frames import rotation
from hrp2_sim_bridge.physics.kinematics import LinkStates
from hrp2_sim_bridge.sensors.imu import AttitudeFilter, Imu, imu_variances, mean_rate
from hrp2_sim_bridge.settings import TICK, SensorSettings
from hypothesis import given
from hypothesis import strategies as st

LEVEL = np.array([0.0, 0.0, 0.0, 1.0])
UP = np.array([0.0, 0.0, GRAVITY])
ANGLES = st.floats(-1.4, 1.4)
RATES = st.tuples(*[st.floats(-20.0, 20.0)] * 3).map(np.array)


def axis_turn(axis, angle):
    """Return the quaternion of a rotation about an axis (0, 1, 2)."""
    quaternion = np.zeros(4)
    quaternion[axis], quaternion[3] = math.sin(angle / 2.0), math.cos(angle / 2.0)
    return quaternion


def tilt_error(estimate, truth=LEVEL):
    """Return the angle between the verticals of two attitudes [deg]."""
    cosine = rotation(estimate)[2] @ rotation(truth)[2]
    return math.degrees(math.acos(min(1.0, cosine)))


def state(velocity=0.0, quaternion=LEVEL):
    """Return the state of an IMU that moves sideways at a velocity [m/s]."""
    return LinkStates(
        np.zeros(3), rotation(quaternion), np.array([0.0, velocity, 0.0]), np.zeros(3))


def errors_in(velocities, seed):
    """Return tilt errors (N) [deg] and the IMU of a level robot with sideways speeds (N + 1)."""
    random = np.random.default_rng(seed)
    states = [state(velocity) for velocity in velocities]
    imu = Imu(SensorSettings(), random, states[0])
    readings = [
        imu.read(before, after, random.standard_normal(6))
        for before, after in pairwise(states)]
    return np.array([tilt_error(reading.orientation) for reading in readings]), imu


@given(RATES)
def test_mean_rate_is_that_of_the_rotation_between(rate):
    """The mean rate is the one by which the filter turned the attitude."""
    start = axis_turn(0, 0.7)
    after = AttitudeFilter(start, np.zeros(3)).update(rate, np.zeros(3), TICK)
    np.testing.assert_allclose(mean_rate(rotation(start), rotation(after)), rate, atol=1e-7)


@given(ANGLES, st.sampled_from([0, 1]))
def test_a_tilted_robot_starts_from_its_own_attitude(angle, axis):
    """At power-on the attitude is right to 0.3 deg in any tilt, from the accelerometer alone."""
    hanging = state(quaternion=axis_turn(axis, angle))
    imu = Imu(SensorSettings(), np.random.default_rng(0), hanging)
    reading = imu.read(hanging, hanging, np.zeros(6))
    assert tilt_error(reading.orientation, axis_turn(axis, angle)) < 0.3


def test_swaying_attitude_is_right_to_1_deg():
    """The attitude is right to 1 deg in a sway of 2 m/s^2 at 0.5 Hz for six seconds."""
    time = np.arange(0.0, 6.0, TICK)
    errors, _ = errors_in(2.0 / math.pi * np.sin(math.pi * time), 0)
    assert errors.max() < 1.0


def test_attitude_through_a_hit_is_right_to_1_deg():
    """The attitude is right to 1 deg in a run-up to 0.5 m/s that ends at 3.4 g within 15 ms."""
    run_up = np.linspace(0.0, -0.5, 101)
    speed = np.concatenate([run_up, -0.5 * np.array([2.0, 1.0]) / 3.0, np.zeros(200)])
    errors, _ = errors_in(speed, 0)
    assert errors.max() < 1.0


def test_filter_follows_a_turn_about_every_axis():
    """The filter follows an exact gyro through 0.5 rad about each axis."""
    for axis in range(3):
        estimator = AttitudeFilter(LEVEL, np.zeros(3))
        for tick in range(100):
            truth = axis_turn(axis, 0.005 * (tick + 1))
            # The vertical at the tick's begin: the filter corrects before it turns.
            force = rotation(axis_turn(axis, 0.005 * tick)).T @ UP
            found = estimator.update(np.eye(3)[axis], force, TICK)
        np.testing.assert_allclose(found, truth, atol=1e-6)


def test_wrong_tilt_is_corrected_slowly():
    """An error of 0.5 deg decays with k_P = 0.15 / s, a little faster because of k_I."""
    estimator = AttitudeFilter(axis_turn(0, math.radians(0.5)), np.zeros(3))
    found = [tilt_error(estimator.update(np.zeros(3), UP, TICK)) for _ in range(1333)]
    assert found[1332] == pytest.approx(0.5 / math.e, rel=0.15)  # 1 / k_P = 6.67 s
    assert np.all(np.diff(found) < 0.0)


@pytest.mark.nightly("statistics of sixty power-ons")
def test_variances_are_those_of_the_readings():
    """The stated variances are those of tilt, rate and force over power-ons after ten seconds."""
    settings = SensorSettings()
    variances = imu_variances(settings)
    tilts, rates, forces = [], [], []
    for seed in range(60):
        random = np.random.default_rng(seed)
        imu = Imu(settings, random, state())
        for normal in random.standard_normal((2000, 6)):
            reading = imu.read(state(), state(), normal)
        tilts.append(2.0 * reading.orientation[:2])
        rates.append(reading.angular_velocity)
        forces.append(reading.specific_force - UP)
    assert np.std(tilts) == pytest.approx(math.sqrt(variances.orientation[0]), rel=0.25)
    assert np.std(rates) == pytest.approx(math.sqrt(variances.angular_velocity[0]), rel=0.2)
    assert np.std(forces) == pytest.approx(math.sqrt(variances.specific_force[0]), rel=0.2)
    assert variances.orientation[2] > 1.0
