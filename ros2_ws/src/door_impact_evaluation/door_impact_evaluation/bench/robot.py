"""Measure plans, physics engines, bridge and graph, each beside its peer.

The peer of a planner is the loop that one would write first: at each sample of the same motion
inverse kinematics by iteration, then finite differences and the Newton-Euler algorithm. It makes
postures and ZMP alone, without search and checks.

Each benchmark takes the number of its runs, whose median counts, and returns its figure and that of
its peer; times of plans are processor times. It raises `BenchError` if the two find different ZMPs,
or if a demonstration fails.
"""

import itertools
import json
import math
import signal
import subprocess
import sys
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter, process_time

import numpy as np
import pinocchio as pin
from builtin_interfaces.msg import Time
from door_impact_common.arrays import Array
from door_model.door.config import load_door
from hrp2_description.robot import SIDES, load_robot_config
from hrp2_sim_bridge.settings import TICK
from hrp2_sim_bridge.world import World
from humanoid_motion.knots import Knots
from humanoid_motion.robot_model import RobotModel
from impact_planner.motion.run_up import time_run_up
from impact_planner.plan import plan_impact
from impact_planner.ros.messages import plan_message
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest, Task
from walking.footsteps.footstep import Pose, Stance
from walking.footsteps.planner import plan_footsteps
from walking.passing.approach import AS_SURVEYED
from walking.passing.passage import plan_passage as plan_whole_passage
from walking.pattern.plan import plan_walk as plan_whole_walk
from walking.pattern.state import standing
from walking.pattern.walk_plan import WalkPlan

from door_impact_evaluation.bench.door import timed
from door_impact_evaluation.errors import BenchError
from door_impact_evaluation.run.driver_link import hit_plan_of
from door_impact_evaluation.run.rehearsal import planned

_ANGLES_DEG = (12.0, 30.0)  # range of the requested opening angles [deg]
_TARGET_DEG = 25.0  # of the plan that the peer computes, too, and of the simulated hit [deg]
_TARGET = PlanRequest(math.radians(_TARGET_DEG))
# Range of the speeds of B in the run-ups that are timed, as shares of the plan's: along the same
# postures a slower run-up needs less acceleration, so that each can be planned.
_RETIME_SHARES = (0.6, 1.0)
_GOAL = Pose(1.8, 0.0, math.radians(70.0))  # goal of the walk, some 15 s away
_SOLES = 0.19  # distance of the soles at the start of the walk [m]
_PERIOD = 0.005  # HRP-2's control period, by which the walk is sampled [s]
_SAME_ZMP = 1.5e-3  # largest rms difference between the plan's ZMP and the peer's [m]
_IK_TOLERANCE, _IK_PASSES = 1e-8, 20  # error [m, rad] and number of passes at which it ends
_FAR = 0.9  # distance of a door that the standing robot is not near to [m]


def plan_service(repeats: int) -> tuple[float, float]:
    """Measure a request: plan, response and the topic's message, nothing cached [ms]."""
    robot, known = RobotModel(load_robot_config()), KnownDoor.configured(load_door("paper"))
    plan = plan_impact(_TARGET, known, robot)  # the first one also loads files

    angles = np.radians(np.random.default_rng(0).uniform(*_ANGLES_DEG, repeats)).tolist()

    def request() -> None:
        answer = plan_impact(PlanRequest(angles.pop()), known, robot)
        for trajectories in (False, True):
            plan_message(answer, robot.joint_names, Time(), trajectories=trajectories)

    ours = median(timed(request)[0] for _ in range(repeats))
    theirs = 0.0
    for phase in plan.phases[:-1]:  # the last one holds the door
        # After the planned contact the samples of the run-up are an emergency stop.
        kept = phase.time <= (plan.contact_time if phase.name == "cam" else math.inf)
        joints = phase.knots.at(phase.time[kept])[0]
        chain = robot.leg_chains["left"]
        base = plan.left_foot - chain.place(joints, np.zeros((len(joints), 3))).end
        q = [robot.configuration(*row) for row in zip(base, joints, strict=True)]
        theirs += _peer(robot, phase.time[kept], q, phase.zmp_samples[kept])
    return 1e3 * ours, 1e3 * theirs


def plan_retime(repeats: int) -> tuple[float, float]:
    """Measure timing a run-up anew for another v_rB, beside the whole plan anew [ms]."""
    robot, known = RobotModel(load_robot_config()), KnownDoor.configured(load_door("paper"))
    plan = plan_impact(_TARGET, known, robot)
    task = Task(robot, known, plan.request, plan.settings)
    stance, table = plan.hit.stance, plan.hit.run_up.table
    shares = np.random.default_rng(0).uniform(*_RETIME_SHARES, repeats)
    speeds = (plan.hit.v_run_up * shares).tolist()
    ours = median(timed(lambda: time_run_up(task, stance, table, speeds.pop()))[0]
                  for _ in range(repeats))
    whole = median(timed(lambda: plan_impact(_TARGET, known, robot))[0] for _ in range(repeats))
    return 1e3 * ours, 1e3 * whole


def plan_walk(repeats: int) -> tuple[float, float]:
    """Measure the plan of a walk of some 15 s, footsteps included [ms]."""
    robot, stance = RobotModel(load_robot_config()), Stance.around(Pose(0.0, 0.0, 0.0), _SOLES)

    def walk() -> WalkPlan:
        footsteps = plan_footsteps(robot.config, stance, _GOAL)
        return plan_whole_walk(robot, standing(robot, stance), footsteps)

    plan = walk()  # also loads files
    ours = median(timed(walk)[0] for _ in range(repeats))
    return 1e3 * ours, 1e3 * _peer_of_walk(robot, plan)


def plan_passage(repeats: int) -> tuple[float, float]:
    """Measure the plan of a passage from the planned end of the paper door's hit [ms]."""
    robot, known = RobotModel(load_robot_config()), KnownDoor.configured(load_door("paper"))
    hit = hit_plan_of(planned(robot, known, _TARGET_DEG, "mcv50", "pass"))
    task = hit.hold(known, AS_SURVEYED).task()
    plan = plan_whole_passage(robot, task)  # also loads files
    ours = median(timed(lambda: plan_whole_passage(robot, task))[0] for _ in range(repeats))
    return 1e3 * ours, 1e3 * _peer_of_walk(robot, plan.walk, plan.hand_force)


def _peer_of_walk(robot: RobotModel, plan: WalkPlan, hand_force: Array | None = None) -> float:
    """Run the peer's loop over a walk with a force on the hand at its knots, (N, 3) [N]."""
    motion, yaw = plan.motion, plan.motion.base_yaw
    assert yaw is not None
    time = np.arange(0.0, plan.duration, _PERIOD)
    course = Knots(
        motion.time, np.column_stack([motion.base, yaw.angle, motion.joints]),
        np.column_stack([motion.base_speed, yaw.speed, motion.joint_speed]),
        np.column_stack([motion.base_acceleration, yaw.acceleration, motion.joint_acceleration]),
    ).at(time)[0]
    q = [robot.configuration(row[:3], row[4:]) for row in course]
    for whole, turn in zip(q, 0.5 * course[:, 3], strict=True):
        whole[3:7] = 0.0, 0.0, math.sin(turn), math.cos(turn)
    force = np.zeros((len(motion.time), 3)) if hand_force is None else hand_force
    zmp, load = (np.column_stack([np.interp(time, motion.time, column) for column in columns.T])
                 for columns in (plan.zmp, force))
    return _peer(robot, time, q, zmp, load)


def _peer(
    robot: RobotModel, time: Array, wanted: list[Array], zmp: Array, load: Array | None = None
) -> float:
    """Run the peer's loop.

    Args:
        robot: The robot.
        time: Times of the samples (N,) [s].
        wanted: Configurations of the motion at these times. The peer takes the CoM, the base's
            height and heading, the soles and the upper body from them, and finds the rest.
        zmp: The plan's ZMP at these times (N, 2) [m].
        load: Force on the hand at these times, axes of odom, (N, 3) [N]; None: there is none.

    Returns:
        Processor time [s].

    Raises:
        BenchError: The peer finds another ZMP.
    """
    model, data = robot.model, robot.data
    legs = np.concatenate([robot.leg_columns[side] for side in SIDES])
    free = np.concatenate([np.arange(3), robot.v_index[legs]])
    found = np.concatenate([np.arange(3), robot.q_index[legs]])
    frames = [robot.feet[side].frame for side in SIDES]
    tasks = [(robot.com(q)[:2], q[2], [robot.frame_pose(q, frame) for frame in frames])
             for q in wanted]
    begin = process_time()
    course: list[Array] = []
    for q, (com, height, soles) in zip(wanted, tasks, strict=True):
        here = q.copy()
        here[found] = (course[-1] if course else q)[found]
        for _ in range(_IK_PASSES):
            jacobian = [np.array(pin.jacobianCenterOfMass(model, data, here))[:2],
                        np.eye(1, model.nv, 2)]
            error = [com - np.array(data.com[0])[:2], [height - here[2]]]
            for frame, (place, turn) in zip(frames, soles, strict=True):
                position, rotation = robot.frame_pose(here, frame)
                jacobian.append(robot.frame_jacobian(here, frame))
                error += [place - position, pin.log3(turn @ rotation.T)]
            off = np.concatenate(error)
            if np.abs(off).max() < _IK_TOLERANCE:
                break
            step = np.zeros(model.nv)
            step[free] = np.linalg.solve(np.vstack(jacobian)[:, free], off)
            here = np.array(pin.integrate(model, here, step))
        course.append(here)
    period = np.diff(time)[:, None]
    speed = np.array([pin.difference(model, *pair) for pair in itertools.pairwise(course)]) / period
    v, a = 0.5 * (speed[1:] + speed[:-1]), 2.0 * np.diff(speed, axis=0) / (period[1:] + period[:-1])
    places = []
    for row, q in enumerate(course[1:-1]):
        wrench = pin.Force(np.array(pin.rnea(model, data, q, v[row], a[row])[:6]))
        floor = pin.XYZQUATToSE3(q[:7]).act(wrench)
        if load is not None:
            place = robot.frame_position(q, robot.config.hand_link)
            floor -= pin.Force(load[row + 1], np.cross(place, load[row + 1]))
        places.append(np.array([-floor.angular[1], floor.angular[0]]) / floor.linear[2])
    taken = process_time() - begin
    off_by = float(np.sqrt(np.mean((np.array(places) - zmp[1:-1]) ** 2)))
    if not off_by < _SAME_ZMP:
        raise BenchError(
            f"the ZMP differs from its peer's by {1e3 * off_by:.2f} mm (rms), at most "
            f"{1e3 * _SAME_ZMP:.1f} mm is allowed")
    return taken


def engine_step(repeats: int) -> tuple[float, float]:
    """Measure a step of the standing robot, without the bridge, in MuJoCo and in PyBullet [us].

    Args:
        repeats: Number of control ticks, whose median counts.
    """
    def step(engine: str) -> float:
        times, steps = _standing(engine, repeats)
        return 1e6 * float(np.median(np.diff(times[:, 1]))) / steps

    return step("mujoco"), step("pybullet")


def bridge_overhead(repeats: int) -> tuple[float, float]:
    """Measure the bridge, beside PyBullet's steps alone [s per simulated second].

    Args:
        repeats: Number of control ticks of the standing robot.
    """
    times, _ = _standing("pybullet", repeats)
    bridge, engine, processor, wall = times[-1] - times[0]
    # On a machine that has other work to do, wall times are longer than on an idle one. They are
    # multiplied by the share of a core that this process got meanwhile. Its processor time is read
    # once a tick: reading it around each physics step would take longer than the step.
    share = processor / wall / (repeats * TICK)
    return float(share * bridge), float(share * engine)


def _standing(engine: str, ticks: int) -> tuple[Array, float]:
    """Simulate the standing robot, far from the door.

    Returns:
        Times before the first and after each tick, (ticks + 1, 4): wall time of the world and of
        its engine, processor time and wall time of this process [s]; and the steps of a tick.
    """
    world = World(load_robot_config(), load_door("paper"), _FAR, 0.0, engine=engine)
    times = []
    try:
        for tick in range(ticks + 1):
            if tick:
                world.step()
            times.append(
                (world.wall_time, world.engine.stepping_time, process_time(), perf_counter()))
        return np.array(times), TICK / world.time_step
    finally:
        world.close()


def real_time_factor(repeats: int) -> tuple[float, float]:
    """Measure simulated over wall time of a demonstration, in PyBullet and in MuJoCo."""
    def demonstrate(engine: str) -> float:
        with TemporaryDirectory() as folder:
            command = [sys.executable, "-m", "door_impact_evaluation.demo.demo", "--engine", engine,
                       "--out", folder]
            with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                  text=True) as demo:
                try:
                    _, complaint = demo.communicate()
                except KeyboardInterrupt:
                    demo.send_signal(signal.SIGINT)  # it must stop its nodes
                    demo.wait()
                    raise
            if demo.returncode:
                raise BenchError(f"the demonstration ended with {demo.returncode}: {complaint}")
            summary = json.loads(Path(folder, "summary.json").read_text(encoding="utf-8"))
        return float(summary["run"]["real_time_factor"])

    pybullet, mujoco = (median(demonstrate(engine) for _ in range(repeats))
                        for engine in ("pybullet", "mujoco"))
    return pybullet, mujoco
