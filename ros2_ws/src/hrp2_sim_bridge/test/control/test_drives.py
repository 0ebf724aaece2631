import dataclasses

import numpy as np
import pytest
from hrp2_sim_bridge.control.drives import JointDrives
from hypothesis import given
from hypothesis import strategies as st

STEP = 2.5e-4
STILL = np.zeros(30)


def drives_of(robot, **scales):
    return JointDrives(robot, robot.drives.scaled(**scales), robot.half_sitting)


def advance(drives, reference, rate, link, speed):
    return drives.torque(np.array([reference, rate]), np.array([link, speed]))


def run(drives, robot, seconds, link, reference=None, rate=STILL):
    """Hold the links at positions and let the motors move; return the last torques."""
    drives.set_step(STEP, robot.half_sitting)
    reference = robot.half_sitting if reference is None else reference
    for _ in range(round(seconds / STEP)):
        torque = advance(drives, reference, rate, link, STILL)
    return torque


def test_at_rest_servo_and_gear_yield_as_two_springs_in_series(robot) -> None:
    """A link that is held aside shows the stiffness 1 / (1 / P + 1 / k), unless the step limits."""
    drives, data = drives_of(robot), robot.drives
    aside = 1e-4
    torque = run(drives, robot, 6.0, robot.half_sitting - aside)
    wanted = aside / (1.0 / data.position_gain + 1.0 / data.stiffness)
    heavy = [robot.index(name) for name in robot.joint_names if "JOINT6" not in name]
    np.testing.assert_allclose(torque[heavy], wanted[heavy], rtol=0.03)


def test_the_motors_torque_stays_within_its_limit(robot) -> None:
    """A reference far away asks for more than each motor has."""
    drives = drives_of(robot)
    drives.set_step(STEP, robot.half_sitting)
    for _ in range(400):
        advance(drives, robot.half_sitting + 0.5, STILL, robot.half_sitting, STILL)
        assert (np.abs(drives.motor) <= robot.effort_limit * (1.0 + 1e-12)).all()
    assert (drives.motor > 0.0).any()


def test_a_motor_drives_no_faster_than_its_largest_speed(robot) -> None:
    """A free motor that is asked for a far place keeps to its speed, but for one step's gain."""
    drives, data = drives_of(robot), robot.drives
    drives.set_step(STEP, robot.half_sitting)
    gain = STEP * robot.effort_limit / data.inertia
    for _ in range(400):
        advance(drives, robot.half_sitting + 100.0, STILL, drives.position, drives.speed)
        assert (drives.speed <= robot.velocity_limit + gain).all()


@given(st.sampled_from([1e-4, 2.5e-4, 5e-4]), st.integers(0, 29), st.floats(0.01, 2.0),
       st.sampled_from([0.5, 1.0, 2.0]))
def test_a_struck_joint_loses_energy_with_any_step(robot, step, joint, speed, scale) -> None:
    """Links with their own inertia swing on their gears and never gain energy."""
    drives = drives_of(robot, gear=scale)
    drives.set_step(step, robot.half_sitting)
    link, rate = np.array(robot.half_sitting), np.zeros(30)
    rate[joint] = speed
    inertia = drives.link_inertia
    first = 0.5 * float(inertia[joint]) * speed**2
    largest = 0.0
    for _ in range(round(0.05 / step)):
        torque = advance(drives, robot.half_sitting, STILL, link, rate)
        rate = rate + step * torque / inertia
        link = link + step * rate
        largest = max(largest, 0.5 * float(inertia @ rate**2))
    assert largest <= first * (1.0 + 1e-9)
    assert 0.5 * float(inertia @ rate**2) < 0.5 * first


def test_a_gear_moves_as_two_masses_on_a_spring(robot) -> None:
    """Without servo and damping, rotor and link swing with sqrt(k (1/B + 1/I))."""
    free = dataclasses.replace(
        robot.drives, position_gain=np.full(30, 1e-9), speed_gain=np.full(30, 1e-9),
        damping=np.zeros(30))
    drives = JointDrives(robot, free, robot.half_sitting)
    drives.set_step(2e-5, robot.half_sitting)
    joint = robot.index("RARM_JOINT1")
    link, rate, inertia = np.array(robot.half_sitting), np.zeros(30), drives.link_inertia
    rate[joint] = 1.0
    turns = []
    for _ in range(3000):
        torque = advance(drives, drives.position, drives.speed, link, rate)
        rate = rate + 2e-5 * torque / inertia
        link = link + 2e-5 * rate
        turns.append(float(torque[joint]))
    crossings = np.flatnonzero(np.diff(np.sign(turns)) != 0)
    measured = np.pi / (2e-5 * np.diff(crossings).mean())
    rotor = robot.drives.inertia[joint]
    wanted = np.sqrt(robot.drives.stiffness[joint] * (1.0 / rotor + 1.0 / inertia[joint]))
    assert measured == pytest.approx(wanted, rel=0.01)
    momentum = rotor * drives.speed[joint] + inertia[joint] * rate[joint]
    assert momentum == pytest.approx(inertia[joint], rel=1e-6)
