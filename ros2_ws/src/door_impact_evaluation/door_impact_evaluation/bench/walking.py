"""Measures how fast walks are planned; the peer is a simple loop over samples of the same walk."""

import itertools
import math
from time import process_time
from typing import Any

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES, load_robot_config
from humanoid_motion.knots import Knots
from humanoid_motion.robot_model import RobotModel
from walking.footsteps.footstep import Footstep, Pose, Stance
from walking.footsteps.planner import plan_footsteps
from walking.pattern.plan import plan_walk as plan_whole_walk
from walking.pattern.state import standing
from walking.pattern.walk_plan import WalkPlan

from door_impact_evaluation.errors import BenchError

_GOAL = (1.8, 0.0, 70.0)  # goal of the walk, some 15 s away: x, y [m], yaw [deg]
_PLANS = 15  # plans of which the median counts
_PERIOD = 0.005  # HRP-2's control period, by which the peer samples the walk [s]
_SAME_ZMP = 1.5e-3  # largest rms difference between the two ZMPs [m]
_IK_TOLERANCE = 1e-8  # error at which the peer's inverse kinematics ends [m, rad]
_IK_PASSES = 20  # iterations of the peer's inverse kinematics at most

# CoM, height and heading of the base, and poses of both soles.
_Wanted = tuple[Array, float, float, list[Any]]


def plan_walk() -> tuple[float, float, float]:
    """Measures a walk of some 15 s from half-sitting, footsteps included.

    Returns:
        Median processor time [ms], that of a loop over the samples of the same walk that computes
        postures and ZMP alone [ms], and the walk's duration [s].

    Raises:
        BenchError: The two find different ZMPs.
    """
    robot = RobotModel(load_robot_config())
    stance, footsteps = _footsteps(robot)
    plan = plan_whole_walk(robot, standing(robot, stance), footsteps)  # also loads shapes
    times = []
    for _ in range(_PLANS):
        begin = process_time()
        _, footsteps = _footsteps(robot)
        plan_whole_walk(robot, standing(robot, stance), footsteps)
        times.append(process_time() - begin)
    return 1e3 * float(np.median(times)), 1e3 * _naive(robot, plan), plan.duration


def plan_step() -> tuple[float, float]:
    """Measures a plan at each step of that walk: two steps ahead, and to rest.

    Returns:
        Median and largest processor time [ms].
    """
    robot = RobotModel(load_robot_config())
    stance, footsteps = _footsteps(robot)
    plan = plan_whole_walk(robot, standing(robot, stance), footsteps)
    times = []
    for _ in range(3):
        for step in range(1, len(footsteps) - 1):
            begin = process_time()
            plan_whole_walk(robot, plan.boundaries[step], footsteps[step : step + 2])
            times.append(process_time() - begin)
    return 1e3 * float(np.median(times)), 1e3 * float(np.max(times))


def _footsteps(robot: RobotModel) -> tuple[Stance, list[Footstep]]:
    x, y, yaw = _GOAL
    stance = Stance.around(Pose(0.0, 0.0, 0.0), 0.19)
    return stance, plan_footsteps(robot.config, stance, Pose(x, y, math.radians(yaw)))


def _naive(robot: RobotModel, plan: WalkPlan) -> float:
    """Computes postures and ZMP sample by sample; returns the processor time [s].

    It uses iterated inverse kinematics, finite differences and the Newton-Euler algorithm.

    Raises:
        BenchError: The ZMP differs from the plan's.
    """
    time = np.arange(0.0, plan.duration, _PERIOD)
    wanted = [_wanted(robot, q) for q in _configurations(robot, plan, time)]
    upper = plan.knots.at(time)[0]
    begin = process_time()
    legs = robot.v_index[np.concatenate([robot.leg_columns[side] for side in SIDES])]
    free = np.concatenate([np.arange(3), legs])
    q = robot.configuration(plan.motion.base[0], plan.motion.joints[0])
    course = np.empty((len(time), len(q)))
    for row, tasks in enumerate(wanted):
        q = _posture(robot, q, upper[row], tasks[2])
        for _ in range(_IK_PASSES):
            error, jacobian = _errors(robot, q, tasks)
            if np.abs(error).max() < _IK_TOLERANCE:
                break
            v = np.zeros(robot.model.nv)
            v[free] = np.linalg.solve(jacobian[:, free], error)
            q = np.array(pin.integrate(robot.model, q, v))
        course[row] = q
    speed = np.array([pin.difference(robot.model, one, two) / _PERIOD
                      for one, two in itertools.pairwise(course)])
    zmp = np.empty((len(time) - 2, 2))
    for row in range(len(zmp)):
        v, a = 0.5 * (speed[row] + speed[row + 1]), (speed[row + 1] - speed[row]) / _PERIOD
        q = course[row + 1]
        wrench = pin.rnea(robot.model, robot.data, q, v, a)[:6]
        turn = pin.Quaternion(*q[[6, 3, 4, 5]]).matrix()
        force = turn @ wrench[:3]
        moment = turn @ wrench[3:] + np.cross(q[:3], force)
        zmp[row] = -moment[1] / force[2], moment[0] / force[2]
    taken = process_time() - begin
    planned = np.column_stack([
        np.interp(time[1:-1], plan.motion.time, column) for column in plan.zmp.T])
    off = float(np.sqrt(np.mean((zmp - planned) ** 2)))
    if not off < _SAME_ZMP:
        raise BenchError(
            f"the ZMP of the walk differs from its peer's by {1e3 * off:.2f} mm (rms), at most "
            f"{1e3 * _SAME_ZMP:.1f} mm is allowed")
    return taken


def _configurations(robot: RobotModel, plan: WalkPlan, time: Array) -> list[Array]:
    """Pinocchio's configurations of the walk at times (N,) [s], between its knots by quintics."""
    motion, yaw = plan.motion, plan.motion.base_yaw
    assert yaw is not None
    base = Knots(
        motion.time, np.column_stack([motion.base, yaw.angle]),
        np.column_stack([motion.base_speed, yaw.speed]),
        np.column_stack([motion.base_acceleration, yaw.acceleration]))
    rows = zip(base.at(time)[0], plan.knots.at(time)[0], strict=True)
    return [_posture(robot, robot.configuration(row[:3], joints), joints, row[3])
            for row, joints in rows]


def _posture(robot: RobotModel, q: Array, joints: Array, yaw: float) -> Array:
    """Set heading and upper body; the legs keep the angles that they have in q."""
    out = q.copy()
    legs = np.concatenate([robot.leg_columns[side] for side in SIDES])
    rest = np.setdiff1d(np.arange(len(joints)), legs)
    out[robot.q_index[rest]] = joints[rest]
    out[3:7] = 0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw)
    return out


def _wanted(robot: RobotModel, q: Array) -> _Wanted:
    yaw = 2.0 * math.atan2(q[5], q[6])
    soles = [pin.SE3(rotation, place) for place, rotation in (
        robot.frame_pose(q, robot.feet[side].frame) for side in SIDES)]
    return robot.com(q)[:2], float(q[2]), yaw, [soles[0], soles[1]]


def _errors(robot: RobotModel, q: Array, wanted: _Wanted) -> tuple[Array, Array]:
    """Returns errors (15,) of CoM, waist height and both soles, and their Jacobian (15, nv)."""
    com, height, _, soles = wanted
    model, data = robot.model, robot.data
    jacobian = [np.array(pin.jacobianCenterOfMass(model, data, q))[:2], np.zeros((1, model.nv))]
    jacobian[1][0, 2] = 1.0
    error = [com - np.array(data.com[0])[:2], np.array([height - q[2]])]
    pin.computeJointJacobians(model, data, q)
    for side, sole in zip(SIDES, soles, strict=True):
        frame = model.getFrameId(robot.feet[side].frame)
        here = pin.updateFramePlacement(model, data, frame)
        jacobian.append(np.array(pin.getFrameJacobian(
            model, data, frame, pin.ReferenceFrame.LOCAL)))
        error.append(np.array(pin.log6(here.actInv(sole)).vector))
    return np.concatenate(error), np.vstack(jacobian)
