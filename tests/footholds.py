"""Robots that stand and walk on known footholds, for the tests of the odometry."""

import numpy as np
import pinocchio as pin
from hrp2_description.robot import load_robot_config
from humanoid_motion.kinematics import inverse_pose, planar_pose
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.samples import ImuSample

ROBOT = load_robot_config()
MODEL = RobotModel(ROBOT)


def legs(base, soles):
    """Joint angles for given poses of base and soles, by Newton's method from half-sitting."""
    model, data = MODEL.model, MODEL.data
    q = MODEL.configuration(np.zeros(3), ROBOT.half_sitting)
    for side, pose in soles.items():
        target = inverse_pose(base) @ pose
        aim = pin.SE3(target[:3, :3].copy(), target[:3, 3].copy())
        frame = model.getFrameId(ROBOT.feet[side].sole)
        leg = MODEL.leg_columns[side]
        for _ in range(60):
            pin.framesForwardKinematics(model, data, q)
            error = pin.log6(data.oMf[frame].actInv(aim)).vector
            if np.linalg.norm(error) < 1e-13:
                break
            slope = pin.computeFrameJacobian(model, data, q, frame, pin.ReferenceFrame.LOCAL)
            q[MODEL.q_index[leg]] += np.linalg.solve(slope[:, MODEL.v_index[leg]], error)
        assert np.linalg.norm(error) < 1e-10, (side, error)
    return q[MODEL.q_index]


def assert_true(pose, base, soles):
    """Assert that the odometry has the true poses of base and soles."""
    np.testing.assert_allclose(pose.base, base, atol=1e-9)
    for side, sole in soles.items():
        np.testing.assert_allclose(pose.soles[side], sole, atol=1e-9)


def base_at(x, y, z=0.62, tilt=(0.0, 0.0, 0.0)):
    """Pose of base_link from its position and from roll, pitch and heading."""
    pose = np.eye(4)
    pose[:3, :3] = pin.rpy.rpyToMatrix(*tilt)
    pose[:3, 3] = x, y, z
    return pose


def walk(steps, rng):
    """Samples (positions, loads, base, soles) of a walk: shift, lift, place, shift, ..."""
    soles = {"left": planar_pose(0.0, 0.095, 0.0), "right": planar_pose(0.0, -0.095, 0.0)}
    heading = 0.0

    def sample(loads, soles, lean=0.0):
        middle = (soles["left"] + soles["right"])[:2, 3] / 2.0
        tilt = (*rng.uniform(-0.05, 0.05, 2), heading + rng.uniform(-0.03, 0.03))
        base = base_at(*middle + rng.uniform(-0.02, 0.02, 2) + lean, 0.60, tilt)
        return legs(base, soles), loads, base, {side: pose.copy() for side, pose in soles.items()}

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


class ExactImu:
    """The readings of an IMU whose own heading is 1 rad off, from poses of the base."""

    def __init__(self, period=0.01, bias=0.0, robot=MODEL):
        self._robot = robot
        self._period, self._bias, self._before = period, np.array([0.0, 0.0, bias]), None
        self.time = 0.0

    def read(self, positions, base):
        """Return the reading one period later."""
        (imu,) = self._robot.poses_in_base(positions, [ROBOT.imu_frame])
        turn = base[:3, :3] @ imu[:3, :3]
        before = turn if self._before is None else self._before
        self._before = turn
        self.time += self._period
        rate = pin.log3(before.T @ turn) / self._period + turn.T @ self._bias
        elsewhere = pin.Quaternion(pin.rpy.rpyToMatrix(0.0, 0.0, 1.0) @ turn)
        return ImuSample(elsewhere.coeffs().copy(), rate, np.array([0.0, 0.0, 9.81]))
