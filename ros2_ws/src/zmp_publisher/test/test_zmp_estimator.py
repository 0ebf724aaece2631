"""ZMP and margin from the foot wrenches."""

import numpy as np
import pinocchio as pin
import pytest
from door_impact_common.constants import GRAVITY
from footholds import MODEL, ROBOT
from humanoid_motion.kinematics import inverse_pose, planar_pose
from humanoid_motion.zmp import zmp_of
from hypothesis import given
from hypothesis import strategies as st
from zmp_publisher.odometry import FootOdometry
from zmp_publisher.zmp_estimator import ZmpEstimator, wrench_in_world

WEIGHT = ROBOT.mass * GRAVITY
POSES = {"left": planar_pose(0.0, 0.095, 0.0), "right": planar_pose(0.0, -0.095, 0.0)}
NOTHING = np.zeros(6)
small = st.floats(-1.0, 1.0)


def _push_at(point, force):
    """Wrench about the origin of a force through a point."""
    return np.concatenate([force, np.cross(point, force)])


def _estimator(**settings):
    return ZmpEstimator(WEIGHT, ROBOT.soles, **settings)


@given(small, small, small, small, small)
def test_zmp_of_one_force_is_where_it_meets_the_floor_whatever_its_direction(x, y, a, b, height):
    wrench = _push_at(np.array([x, y, height]), np.array([300.0 * a, 300.0 * b, 500.0]))
    np.testing.assert_allclose(zmp_of(wrench[:3], wrench[3:], height), [x, y], atol=1e-9)


def test_with_all_weight_on_one_sole_that_sole_alone_is_the_polygon():
    wrench = _push_at(np.array([0.05, 0.02, 0.0]), np.array([0, 0, WEIGHT]))
    reading = _estimator().read(POSES, {"left": wrench, "right": NOTHING})
    np.testing.assert_allclose(reading.point, [0.05, 0.115], atol=1e-12)
    assert reading.loaded == ("left",)
    assert reading.margin == pytest.approx(0.055)
    assert reading.normal_force == pytest.approx(WEIGHT)


def test_a_foot_that_bears_almost_nothing_is_no_support():
    """At 4 % the right sole does not widen the polygon, at 6 % it does."""
    readings = []
    for share in (0.04, 0.06):
        loads = {"left": (1 - share) * WEIGHT, "right": share * WEIGHT}
        wrenches = {side: [0, 0, load, 0, 0, 0] for side, load in loads.items()}
        readings.append(_estimator().read(POSES, wrenches))
    assert [reading.loaded for reading in readings] == [("left",), ("left", "right")]
    np.testing.assert_allclose(readings[1].point, [0.0, 0.095 * 0.88], atol=1e-12)
    assert np.ptp(readings[0].polygon[:, 1]) == pytest.approx(0.13)
    assert np.ptp(readings[1].polygon[:, 1]) == pytest.approx(0.34)


@pytest.mark.parametrize(("x", "sign"), [(0.12, 1), (0.13, 0), (0.14, -1)])
def test_margin_sign(x, sign):
    """Inside positive, on the edge zero, outside negative, by the distance."""
    wrench = _push_at(np.array([x, 0.0, 0.0]), np.array([0, 0, WEIGHT]))
    reading = _estimator().read(POSES, {"left": wrench, "right": NOTHING})
    assert reading.margin == pytest.approx(sign * 0.01, abs=1e-12)


@pytest.mark.parametrize("force", [0.19 * WEIGHT, np.nan])
def test_silent_below_the_threshold(force):
    """No reading in the air, near it, when pulled, or from NaN."""
    wrenches = {"left": [0, 0, force, 0, 0, 0], "right": NOTHING}
    assert _estimator().read(POSES, wrenches) is None


def _motion(posture, velocity, acceleration):
    """Pinocchio's floor wrench about the odom origin (all external force), CoM, and foot poses."""
    pose = FootOdometry(MODEL, loaded_force=1.0).update(posture, {"left": 300.0, "right": 299.0})
    model, data = MODEL.model, MODEL.model.createData()
    q, v, a = (MODEL.configuration(np.zeros(3), posture), MODEL.velocity(np.zeros(3), velocity),
               MODEL.velocity(np.zeros(3), acceleration))
    q[:7] = pin.SE3ToXYZQUAT(pin.SE3(pose.base[:3, :3].copy(), pose.base[:3, 3].copy()))
    in_base = pin.rnea(model, data, q, v, a)[:6]
    return pose, wrench_in_world(in_base, pose.base), pin.centerOfMass(model, data, q)


def _shared(whole, poses, share, rng):
    """Split a wrench about the origin between the soles, at random but for the right's share."""
    right = whole * share + rng.normal(size=6) * [5, 5, 0, 8, 8, 3]
    parts = {"left": whole - right, "right": right}
    return {side: wrench_in_world(part, inverse_pose(poses[side])) for side, part in parts.items()}


@pytest.mark.parametrize("share", [0.1, 0.8])
def test_standing_zmp_is_below_the_com(share):
    """At rest in half-sitting, however the feet share the load, the ZMP is the CoM's projection."""
    pose, whole, com = _motion(ROBOT.half_sitting, np.zeros(30), np.zeros(30))
    wrenches = _shared(whole, pose.soles, share, np.random.default_rng(3))
    reading = _estimator().read(pose.soles, wrenches)
    np.testing.assert_allclose(reading.point, com[:2], atol=1e-9)
    assert reading.normal_force == pytest.approx(WEIGHT)
    assert reading.margin == pytest.approx(0.1 + com[0], abs=1e-6)


def test_moving_zmp_obeys_newton_and_euler():
    """With joints moving it is the point that the momentum's rate of change gives."""
    rng = np.random.default_rng(7)
    velocity, acceleration = rng.normal(size=30) * 0.3, rng.normal(size=30) * 2.0
    pose, whole, com = _motion(ROBOT.half_sitting, velocity, acceleration)
    wrenches = _shared(whole, pose.soles, 0.4, rng)
    reading = _estimator().read(pose.soles, wrenches)
    about_com = whole[3:] - np.cross(com, whole[:3])  # rate of angular momentum
    fx, fy, fz = whole[:3]
    expected = [
        com[0] - (com[2] * fx + about_com[1]) / fz,
        com[1] - (com[2] * fy - about_com[0]) / fz,
    ]
    np.testing.assert_allclose(reading.point, expected, atol=1e-9)
    assert np.linalg.norm(reading.point - com[:2]) > 1e-3
