"""Measures how fast hits are planned; the peer is a simple loop over the same samples."""

import math
from collections.abc import Iterator
from dataclasses import replace
from time import perf_counter

import numpy as np
import pinocchio as pin
from builtin_interfaces.msg import Time
from door_impact_common.arrays import Array
from door_model.door.config import load_door
from hrp2_description.robot import SIDES, load_robot_config
from humanoid_motion.robot_model import RobotModel
from impact_planner.hit.stance import stance_for_step
from impact_planner.impact_plan import ImpactPlan
from impact_planner.motion.phase_plan import PhasePlan
from impact_planner.motion.posture_table import PostureTable
from impact_planner.motion.run_up import RunUpWish, time_run_up
from impact_planner.plan import plan_impact
from impact_planner.ros.messages import plan_message
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest
from impact_planner.task.settings import PlannerSettings

from door_impact_evaluation.errors import BenchError

_REQUESTS = 40  # plans of random angles
_RANGE_DEG = (12.0, 30.0)  # range of these angles [deg]
_PEER_REQUEST = math.radians(25.0)  # angle of the plan that the peer computes, too [rad]
_SAME_ZMP = 5e-4  # largest rms difference between the two ZMPs [m]
_RETIMED = 20  # run-ups that are timed
_RETIME_SPEEDS = (0.3, 0.5)  # range of the speeds of B in these run-ups [m/s]
_LONGER = 11  # plans of each kind in plan_longer, of which the median counts
_IK_TOLERANCE = 1e-7  # error at which the peer's inverse kinematics ends [m, rad]
_IK_PASSES = 20  # iterations of the peer's inverse kinematics at most


def plan_service() -> tuple[float, float]:
    """Measures a request: the plan, the service's response and the topic's message.

    Returns:
        Median wall time over random angles of the paper's door, nothing cached, and the wall time
        of the simple loop over the samples of one such plan [ms].

    Raises:
        BenchError: The two find different ZMPs.
    """
    robot, known = _robot(), _door()
    angles = np.radians(np.random.default_rng(0).uniform(*_RANGE_DEG, _REQUESTS))
    plan_impact(PlanRequest(float(angles[0])), known, robot)  # the first one also loads files
    times = []
    for angle in angles:
        begin = perf_counter()
        plan = plan_impact(PlanRequest(float(angle)), known, robot)
        plan_message(plan, robot.joint_names, Time(), trajectories=False)
        plan_message(plan, robot.joint_names, Time(), trajectories=True)
        times.append(perf_counter() - begin)
    plan = plan_impact(PlanRequest(_PEER_REQUEST), known, robot)
    begin = perf_counter()
    found = [_naive(robot, plan, phase) for phase in plan.phases if phase.name != "hold"]
    naive = perf_counter() - begin
    for phase, zmp in zip(plan.phases, found, strict=False):
        _require_same(plan, phase, zmp)
    return 1e3 * float(np.median(times)), 1e3 * naive


def plan_longer() -> tuple[float, float]:
    """Measures plans whose slow phases last twice as long.

    Returns:
        Median wall time of these plans, and of the usual ones [ms].
    """
    robot, known, usual = _robot(), _door(), PlannerSettings()
    slow = replace(usual.timing, **{
        name: 2.0 * getattr(usual.timing, name) for name in ("prepare", "shift", "step", "back")})

    def median(settings: PlannerSettings) -> float:
        times = []
        for _ in range(_LONGER):
            begin = perf_counter()
            plan_impact(PlanRequest(_PEER_REQUEST), known, robot, settings)
            times.append(perf_counter() - begin)
        return 1e3 * float(np.median(times))

    median(usual)
    return median(replace(usual, timing=slow)), median(usual)


def plan_retime() -> tuple[float, float]:
    """Measures timing a run-up anew for another v_rB.

    Returns:
        Median wall time over random speeds, and the wall time of the simple loop over the samples
        of one run-up [ms].

    Raises:
        BenchError: The two find different ZMPs.
    """
    robot, known = _robot(), _door()
    plan = plan_impact(PlanRequest(_PEER_REQUEST), known, robot)
    stance = stance_for_step(robot, plan.hit.stance.step, PlannerSettings().com_inside_edge)
    table = PostureTable(robot, stance, 0.05)
    wish = RunUpWish("mcv50", 0.4, 0.02, 0.025, 0.02, 0.9, 0.005)
    times = []
    for speed in np.random.default_rng(0).uniform(*_RETIME_SPEEDS, _RETIMED):
        begin = perf_counter()
        time_run_up(robot, stance, table, replace(wish, v_rb=float(speed)))
        times.append(perf_counter() - begin)
    cam = plan.phase("cam")
    begin = perf_counter()
    zmp = _naive(robot, plan, cam)
    naive = perf_counter() - begin
    _require_same(plan, cam, zmp)
    return 1e3 * float(np.median(times[1:])), 1e3 * naive


def _robot() -> RobotModel:
    return RobotModel(load_robot_config())


def _door() -> KnownDoor:
    return KnownDoor.configured(load_door("paper"))


def _require_same(plan: ImpactPlan, phase: PhasePlan, zmp: Array) -> None:
    # Finite differences are one-sided at the ends, so these samples are left out. In the run-up the
    # samples after the planned contact are left out, too: they are an emergency stop.
    last = int(np.searchsorted(phase.time, plan.contact_time)) if phase.name == "cam" else -4
    inner = slice(4, last)
    off = float(np.sqrt(np.mean((zmp[inner] - phase.zmp_samples[inner]) ** 2)))
    if not off < _SAME_ZMP:
        raise BenchError(
            f"the ZMP in {phase.name} differs from its peer's by {1e3 * off:.2f} mm (rms), at most "
            f"{1e3 * _SAME_ZMP:.1f} mm is allowed")


def _naive(robot: RobotModel, plan: ImpactPlan, phase: PhasePlan) -> Array:
    """Computes the ZMP of a phase sample by sample.

    It uses iterated inverse kinematics, finite differences and the Newton-Euler algorithm.

    Returns:
        ZMP in odom (N, 2) [m].
    """
    time = phase.time
    q = np.array(list(_iterated(robot, plan, phase)))
    v = np.gradient(q, time, axis=0)
    a = np.gradient(v, time, axis=0)
    zmp = np.empty((len(time), 2))
    for i in range(len(time)):
        at = robot.configuration(q[i, :3], q[i, 3:])
        speed = robot.velocity(v[i, :3], v[i, 3:])
        wrench = pin.rnea(
            robot.model, robot.data, at, speed, robot.velocity(a[i, :3], a[i, 3:]))[:6]
        moment = wrench[3:] + np.cross(q[i, :3], wrench[:3])
        zmp[i] = -moment[1] / wrench[2], moment[0] / wrench[2]
    return zmp


def _iterated(robot: RobotModel, plan: ImpactPlan, phase: PhasePlan) -> Iterator[Array]:
    """Finds base and joints (3 + J,) at each sample by Newton's method on feet, CoM and height."""
    joints = phase.knots.at(phase.time)[0]
    legs = np.concatenate([robot.leg_columns[side] for side in SIDES])
    free = np.concatenate([np.arange(3), robot.v_index[legs]])
    left = robot.leg_chains["left"]
    base = plan.left_foot - left.place(joints[:1], np.zeros((1, 3))).end[0]
    whole = joints[0].copy()
    for row, com in zip(joints, phase.com_samples, strict=True):
        whole[:] = np.where(np.isin(np.arange(len(row)), legs), whole, row)
        truth = plan.left_foot - left.place(row[None], np.zeros((1, 3))).end[0]
        right = robot.leg_chains["right"].place(row[None], truth[None]).end[0]
        for _ in range(_IK_PASSES):
            at = robot.configuration(base, whole)
            error, jacobian = _tasks(robot, at, com, truth[2], (plan.left_foot, right), base)
            if np.abs(error).max() < _IK_TOLERANCE:
                break
            change = np.linalg.solve(jacobian[:, free], error)
            base = base + change[:3]
            whole[legs] += change[3:]
        yield np.concatenate([base, whole])


def _tasks(
    robot: RobotModel, q: Array, com: Array, height: float, feet: tuple[Array, Array], base: Array
) -> tuple[Array, Array]:
    """Returns errors (15,) of CoM, waist height and both soles' poses, and their Jacobian."""
    jacobian = [np.array(pin.jacobianCenterOfMass(robot.model, robot.data, q))[:2]]
    error = [com[:2] - np.array(robot.data.com[0])[:2], np.array([height - base[2]])]
    waist = np.zeros((1, robot.model.nv))
    waist[0, 2] = 1.0
    jacobian.append(waist)
    for side, place in zip(SIDES, feet, strict=True):
        position, rotation = robot.frame_pose(q, robot.feet[side].frame)
        jacobian.append(robot.frame_jacobian(q, robot.feet[side].frame))
        error += [place - position, -np.array(pin.log3(rotation))]
    return np.concatenate(error), np.vstack(jacobian)
