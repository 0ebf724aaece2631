"""Leg odometry against footholds that are known."""

import numpy as np
import pinocchio as pin
import pytest
from door_impact_common.errors import SettingError
from hrp2_description.robot import load_robot_config
from humanoid_motion.kinematics import RobotKinematics, inverse_pose, planar_pose
from zmp_publisher.odometry import FootOdometry

ROBOT = load_robot_config()
KINEMATICS = RobotKinematics(ROBOT)
MODEL = pin.buildModelFromUrdf(str(ROBOT.urdf_path))
BOTH = {"left": 285.0, "right": 284.0}


def _odometry(**settings):
    return FootOdometry(KINEMATICS, loaded_force=28.0, **settings)


def _legs(base, soles):
    """Joint angles for given poses of base and soles, by Newton's method from half-sitting."""
    data = MODEL.createData()
    q = pin.neutral(MODEL)
    columns = [MODEL.joints[MODEL.getJointId(name)].idx_q for name in ROBOT.joint_names]
    q[columns] = ROBOT.half_sitting
    for side, pose in soles.items():
        target = inverse_pose(base) @ pose
        aim = pin.SE3(target[:3, :3].copy(), target[:3, 3].copy())
        frame = MODEL.getFrameId(ROBOT.feet[side].sole)
        leg = [columns[ROBOT.index(f"{side[0].upper()}LEG_JOINT{i}")] for i in range(6)]
        for _ in range(60):
            pin.framesForwardKinematics(MODEL, data, q)
            error = pin.log6(data.oMf[frame].actInv(aim)).vector
            if np.linalg.norm(error) < 1e-13:
                break
            slope = pin.computeFrameJacobian(MODEL, data, q, frame, pin.ReferenceFrame.LOCAL)
            q[leg] += np.linalg.solve(slope[:, leg], error)
        assert np.linalg.norm(error) < 1e-10, (side, error)
    return q[columns]


def _base(x, y, z=0.62, tilt=(0.0, 0.0, 0.0)):
    pose = np.eye(4)
    pose[:3, :3] = pin.rpy.rpyToMatrix(*tilt)
    pose[:3, 3] = x, y, z
    return pose


def _walk(steps, rng):
    """Samples (positions, loads, base, soles) of a walk: shift, lift, place, shift, ..."""
    soles = {"left": planar_pose(0.0, 0.095, 0.0), "right": planar_pose(0.0, -0.095, 0.0)}
    heading = 0.0

    def sample(loads, soles, lean=0.0):
        middle = (soles["left"] + soles["right"])[:2, 3] / 2.0
        tilt = (*rng.uniform(-0.05, 0.05, 2), heading + rng.uniform(-0.03, 0.03))
        base = _base(*middle + rng.uniform(-0.02, 0.02, 2) + lean, 0.60, tilt)
        return _legs(base, soles), loads, base, {side: pose.copy() for side, pose in soles.items()}

    yield sample({"left": 300.0, "right": 269.0}, soles)
    for step in range(steps):
        swing, stance = ("right", "left") if step % 2 == 0 else ("left", "right")
        yield sample({swing: 100.0, stance: 469.0}, soles)
        lifted = dict(soles)
        lifted[swing] = soles[swing].copy()
        lifted[swing][2, 3] += 0.03
        lifted[swing][:3, :3] = soles[swing][:3, :3] @ pin.rpy.rpyToMatrix(0.05, -0.1, 0.0)
        yield sample({swing: 0.0, stance: 569.0}, lifted)
        heading += rng.uniform(-0.08, 0.08)
        side = 0.095 if swing == "left" else -0.095
        about = soles[stance][:2, 3]
        ahead = np.array([np.cos(heading), np.sin(heading)])
        across = np.array([-ahead[1], ahead[0]])
        place = about + rng.uniform(-0.05, 0.08) * ahead + 2.1 * side * across
        soles = dict(soles)
        soles[swing] = planar_pose(*place, heading + rng.uniform(-0.05, 0.05))
        yield sample({swing: 250.0, stance: 319.0}, soles)
        yield sample({swing: 469.0, stance: 100.0}, soles)


def test_stepping_returns_the_true_footholds():
    """Over 12 steps with turns, the poses of base and soles are the true ones, also in the air."""
    odometry = _odometry()
    count = 0
    for positions, loads, base, soles in _walk(12, np.random.default_rng(11)):
        pose = odometry.update(positions, loads)
        np.testing.assert_allclose(pose.base, base, atol=1e-9)
        for side in soles:
            np.testing.assert_allclose(pose.soles[side], soles[side], atol=1e-9)
        count += 1
    assert count == 49


def test_small_joint_errors_do_not_grow_into_metres():
    """Encoder noise of 0.1 mrad over 12 steps costs less than a centimetre."""
    rng = np.random.default_rng(2)
    odometry = _odometry()
    for positions, loads, base, _ in _walk(12, np.random.default_rng(11)):
        pose = odometry.update(positions + rng.normal(scale=1e-4, size=30), loads)
        assert np.linalg.norm(pose.base[:3, 3] - base[:3, 3]) < 0.01


def test_odom_is_midway_between_the_feet_whichever_bears_more():
    """Uneven feet at the start: origin at their midpoint, x along their mean heading."""
    base = _base(0.02, 0.01)
    soles = {"left": planar_pose(0.06, 0.11, 0.1), "right": planar_pose(-0.02, -0.10, -0.04)}
    positions = _legs(base, soles)
    poses = [
        _odometry().update(positions, {"left": left, "right": 569.0 - left}) for left in (400, 150)
    ]
    np.testing.assert_allclose(poses[0].base, poses[1].base, atol=1e-9)
    placed = poses[0].soles
    np.testing.assert_allclose((placed["left"] + placed["right"])[:3, 3], 0.0, atol=1e-9)
    headings = [np.arctan2(pose[1, 0], pose[0, 0]) for pose in placed.values()]
    assert sum(headings) == pytest.approx(0.0, abs=1e-9)


def test_half_sitting():
    """In half-sitting the waist is 0.6487 m above the floor and 9.5 mm behind the ankles."""
    pose = _odometry().update(ROBOT.half_sitting, BOTH)
    np.testing.assert_allclose(pose.base[:3, 3], [-0.009490, 0.0, 0.648702], atol=1e-6)
    np.testing.assert_allclose(pose.soles["right"], planar_pose(0.0, -0.095, 0.0), atol=1e-9)


def test_nothing_before_the_first_contact():
    """In the air there is no floor to stand on, so no pose; afterwards the last foothold holds."""
    odometry = _odometry()
    nothing = {"left": 0.0, "right": 3.0}
    assert odometry.update(ROBOT.half_sitting, nothing) is None
    first = odometry.update(ROBOT.half_sitting, BOTH)
    again = odometry.update(ROBOT.half_sitting, nothing)
    np.testing.assert_array_equal(first.base, again.base)
    assert again.support == first.support


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
    crouched = _legs(_base(0.0, -0.03, 0.56), before.soles)
    after = odometry.update(crouched, BOTH)
    np.testing.assert_allclose(after.base, _base(0.0, -0.03, 0.56), atol=1e-9)
    for side, pose in before.soles.items():
        np.testing.assert_allclose(after.soles[side], pose, atol=1e-9)


def test_a_loaded_sole_lies_flat():
    """A loaded second foot that kinematics puts 1 mm into the floor, tilted, is taken as flat."""
    odometry = _odometry()
    soles = dict(odometry.update(ROBOT.half_sitting, BOTH).soles)
    soles["right"] = soles["right"].copy()
    soles["right"][:3, :3] = pin.rpy.rpyToMatrix(0.002, 0.003, 0.0)
    soles["right"][2, 3] = -0.001
    pose = odometry.update(_legs(_base(0.0, 0.0), soles), BOTH)
    np.testing.assert_allclose(pose.soles["right"][2], [0, 0, 1, 0], atol=1e-12)
    lifted = odometry.update(_legs(_base(0.0, 0.0), soles), {"left": 569.0, "right": 0.0})
    np.testing.assert_allclose(lifted.soles["right"], soles["right"], atol=1e-9)


def test_reset_fixes_odom_anew():
    """After a reset the robot is at the origin again, wherever it had walked."""
    odometry = _odometry()
    for positions, loads, _, _ in _walk(3, np.random.default_rng(4)):
        odometry.update(positions, loads)
    odometry.reset()
    pose = odometry.update(ROBOT.half_sitting, BOTH)
    np.testing.assert_allclose((pose.soles["left"] + pose.soles["right"])[:3, 3], 0, atol=1e-9)


@pytest.mark.parametrize("settings", [{"hysteresis": 0.5}, {"hysteresis": -0.1}])
def test_bad_settings_are_refused(settings):
    """The error names the setting."""
    with pytest.raises(SettingError, match="hysteresis"):
        _odometry(**settings)
    with pytest.raises(SettingError, match="loaded_force"):
        FootOdometry(KINEMATICS, loaded_force=0.0)


@pytest.mark.parametrize("bad", [np.zeros(29), np.full(30, np.nan)])
def test_bad_joint_angles_are_refused(bad):
    """Too few angles and NaN are errors, and do not change the odometry."""
    odometry = _odometry()
    before = odometry.update(ROBOT.half_sitting, BOTH)
    with pytest.raises(SettingError):
        odometry.update(bad, BOTH)
    after = odometry.update(ROBOT.half_sitting, BOTH)
    np.testing.assert_array_equal(before.base, after.base)
