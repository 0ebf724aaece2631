"""Leg odometry without an IMU, against footholds that are known."""

import numpy as np
import pinocchio as pin
import pytest
from door_impact_common.errors import SettingError
from footholds import MODEL, ROBOT, assert_true, base_at, legs, walk
from humanoid_motion.kinematics import planar_pose
from zmp_publisher.odometry import FootOdometry

BOTH = {"left": 285.0, "right": 284.0}


def _odometry(**settings):
    return FootOdometry(MODEL, loaded_force=28.0, **settings)


def test_stepping_returns_the_true_footholds():
    """Over 12 steps with turns, the poses of base and soles are the true ones, also in the air."""
    odometry = _odometry()
    for positions, loads, base, soles in walk(12, np.random.default_rng(11)):
        assert_true(odometry.update(positions, loads), base, soles)


def test_odom_is_midway_between_the_feet_whichever_bears_more():
    """Uneven feet at the start: origin at their midpoint, x along their mean heading."""
    base = base_at(0.02, 0.01)
    soles = {"left": planar_pose(0.06, 0.11, 0.1), "right": planar_pose(-0.02, -0.10, -0.04)}
    positions = legs(base, soles)
    poses = [
        _odometry().update(positions, {"left": left, "right": 569.0 - left}) for left in (400, 150)
    ]
    np.testing.assert_allclose(poses[0].base, poses[1].base, atol=1e-9)
    placed = poses[0].soles
    np.testing.assert_allclose((placed["left"] + placed["right"])[:3, 3], 0.0, atol=1e-9)
    headings = [np.arctan2(pose[1, 0], pose[0, 0]) for pose in placed.values()]
    assert sum(headings) == pytest.approx(0.0, abs=1e-9)


def test_a_start_elsewhere_moves_every_pose():
    """The poses of a walk are those from the origin, moved to the start, also after a reset."""
    start = (10.0, -3.0, 2.5)
    here, there = _odometry(), _odometry(start=start)
    for _ in range(2):
        for positions, loads, _, _ in walk(3, np.random.default_rng(8)):
            one, other = (each.update(positions, loads) for each in (here, there))
            moved = {side: planar_pose(*start) @ sole for side, sole in one.soles.items()}
            assert_true(other, planar_pose(*start) @ one.base, moved)
        here.reset()
        there.reset()


def test_support_does_not_chatter():
    """Loads that swing by less than the hysteresis leave the held sole alone."""
    odometry = _odometry(hysteresis=0.05)
    loads = [(300, 269), (265, 304), (300, 269), (200, 369), (290, 279)]
    held = [
        odometry.update(ROBOT.half_sitting, {"left": left, "right": right}).support
        for left, right in loads
    ]
    assert held == ["left", "left", "left", "right", "right"]


def test_a_change_of_posture_moves_the_base_not_the_feet():
    """Crouching in double support leaves both soles where they were."""
    odometry = _odometry()
    before = odometry.update(ROBOT.half_sitting, BOTH)
    crouched = legs(base_at(0.0, -0.03, 0.56), before.soles)
    after = odometry.update(crouched, BOTH)
    assert_true(after, base_at(0.0, -0.03, 0.56), before.soles)


def test_a_loaded_sole_lies_flat():
    """A loaded second foot that kinematics puts 1 mm into the floor, tilted, is taken as flat."""
    odometry = _odometry()
    soles = dict(odometry.update(ROBOT.half_sitting, BOTH).soles)
    soles["right"] = soles["right"].copy()
    soles["right"][:3, :3] = pin.rpy.rpyToMatrix(0.002, 0.003, 0.0)
    soles["right"][2, 3] = -0.001
    pose = odometry.update(legs(base_at(0.0, 0.0), soles), BOTH)
    np.testing.assert_allclose(pose.soles["right"][2], [0, 0, 1, 0], atol=1e-12)
    lifted = odometry.update(legs(base_at(0.0, 0.0), soles), {"left": 569.0, "right": 0.0})
    np.testing.assert_allclose(lifted.soles["right"], soles["right"], atol=1e-9)


@pytest.mark.parametrize("bad", [np.zeros(29), np.full(30, np.nan)])
def test_bad_joint_angles_are_refused(bad):
    """Too few angles and NaN are errors, and do not change the odometry."""
    odometry = _odometry()
    before = odometry.update(ROBOT.half_sitting, BOTH)
    with pytest.raises(SettingError):
        odometry.update(bad, BOTH)
    after = odometry.update(ROBOT.half_sitting, BOTH)
    np.testing.assert_array_equal(before.base, after.base)
