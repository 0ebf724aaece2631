"""Run walks and pushes in the simulation without nodes: plan, execution, driver, physics."""

import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from door_model.door.config import load_door
from hrp2_description.robot import needed
from hrp2_sim_bridge.sensors.sensors import TickSample
from hrp2_sim_bridge.world import World
from humanoid_motion.robot_model import RobotModel
from motion_execution.mission.mission import WALK
from motion_execution.mission.order import Order
from motion_execution.walk.goal import WalkGoal
from motion_execution.walk.walk import Walk
from walking.footsteps.footstep import Pose, Stance
from walking.footsteps.planner import plan_footsteps
from walking.pattern.plan import plan_walk
from walking.pattern.state import standing
from walking.pattern.walk_plan import WalkPlan

from door_impact_evaluation.run import evaluation, simulation_log
from door_impact_evaluation.run.driver_link import DriverLink
from door_impact_evaluation.run.record import Support

PUSH_DURATION = 0.1  # duration of a push [s]
STANDING = 1.5  # simulated time in which the robot stands before `push_standing` pushes it [s]
_STEPS = 5.0  # simulated time after this push [s]
_LONGEST = 20.0  # time beyond that of the plan after which a run ends [s]
_DOOR_DISTANCE = 9.0  # distance of the door's face from the origin of odom [m]
_HINGE_X = 10.0  # distance of the hinge from the origin along x, on the side away from the walk [m]
_SPEED_OVER = 0.005  # time over which a joint's speed is measured: one control tick [s]


@dataclass(frozen=True)
class Push:
    """A push on the robot's center of mass.

    Attributes:
        at_s: Time of its begin, counted from the beginning of the walk [s].
        impulse: Impulse in odom, (3,) [N s].
    """

    at_s: float
    impulse: tuple[float, float, float]


@dataclass(frozen=True)
class Walked:
    """A walk and what was measured of it.

    Attributes:
        plan: Plan whose footsteps were made.
        begin: Time of the log at which the plan begins [s].
        execution: Execution of the plan, after its end.
        log: The simulation's log.
        support: ZMP, support polygon and margin; wrenches are means over 20 ms.
        off: Pose of the middle between the soles at the end, by the simulation's truth, as seen
            from where it was planned.
        max_tilt: Largest tilt of the base [rad].
        speed_share: Largest speed of a joint over a control tick, as a share of its limit.
        pushes: The pushes.
    """

    plan: WalkPlan
    begin: float
    execution: Walk
    log: simulation_log.SimulationLog
    support: Support
    off: Pose
    max_tilt: float
    speed_share: float
    pushes: tuple[Push, ...]

    @property
    def stood(self) -> bool:
        """Whether the robot did not fall within 2 s of the end of the walk."""
        return not self.log.fell

    @property
    def margin(self) -> float:
        """Smallest distance of the ZMP from the edge of the soles, negative outside [m].

        NaN if the feet bore no load at any time.
        """
        known = self.support.margin[np.isfinite(self.support.margin)]
        return float(known.min()) if known.size else math.nan


def plan_between(robot: RobotModel, start: Pose, goal: Pose, **options: Any) -> WalkPlan:
    """Plan a walk from half-sitting at one place to a place.

    Args:
        robot: The robot.
        start: Pose of the middle between the soles at the beginning, in odom.
        goal: The same at the end.
        options: Options of `plan_footsteps`.

    Raises:
        WalkingError: There is no such walk.
        HumanoidMotionError: The motion would exceed a limit.
    """
    stance = Stance.around(start, needed(robot.config.footsteps, "footsteps").width)
    footsteps = plan_footsteps(robot.config, stance, goal, **options)
    return plan_walk(robot, standing(robot, stance), footsteps)


def walk(
    robot: RobotModel, plan: WalkPlan, pushes: Sequence[Push] = (), *, step_change: bool = True,
    **settings: Any,
) -> Walked:
    """Execute a walk in a new simulated world, with the closed door far away.

    Args:
        robot: The robot.
        plan: A walk that begins at rest.
        pushes: Pushes on the robot.
        step_change: Whether a push may change the steps.
        settings: Settings of the simulated world (`WorldSettings`) except its `start`.

    Raises:
        SettingError: A setting of the world or a push is out of its range.
    """
    start = plan.schedule.phases[0].stance.middle
    # The leaf stands on the other side of the origin than the robot, beyond every walk's end.
    hinge_x = math.copysign(_HINGE_X, -start.x)
    world = World(
        robot.config, load_door("paper"), _DOOR_DISTANCE, hinge_x, start=tuple(start), **settings)
    try:
        execution, begin = execute(world, robot, plan, pushes, step_change=step_change)
        with tempfile.TemporaryDirectory() as folder:
            log = simulation_log.load(world.save_log(Path(folder) / "log.npz"), 0.0)
    finally:
        world.close()
    return _judged(robot, execution, begin, plan, log, pushes)


def execute(
    world: World, robot: RobotModel, plan: WalkPlan, pushes: Sequence[Push] = (), *,
    step_change: bool = True,
) -> tuple[Walk, float]:
    """Let a world's robot walk to where a walk ends and then stand, or until it falls.

    The footsteps are planned anew from where it stands by its odometry; it keeps its heading along
    the way.

    Args:
        world: A world in which the robot stands where the walk begins.
        robot: The robot.
        plan: The walk.
        pushes: Pushes on the robot.
        step_change: Whether a push may change the steps; after such a change the robot stands.

    Returns:
        The execution after its end, and the time at which the plan began [s].

    Raises:
        DoorImpactError: The walk cannot begin.
    """
    goal = WalkGoal(plan.stance.middle, keep_heading=True, whole_turns=True)
    link = DriverLink(world, robot, start=plan.schedule.phases[0].stance.middle,
                      wrenches=step_change)
    waiting = sorted(pushes, key=lambda push: push.at_s)

    def push(sample: TickSample) -> None:
        while waiting and sample.time >= link.began + waiting[0].at_s:
            world.push_robot(np.array(waiting.pop(0).impulse), PUSH_DURATION)

    link.watches.append(push)
    execution: Walk = link.run(
        link.mission.walk(goal, Order(WALK)), plan.duration + _LONGEST)
    return execution, link.began


def push_standing(
    world: World, robot: RobotModel, impulse: Sequence[float], *, step_change: bool = True,
) -> bool:
    """Push a robot that has stood for a while, and let it stand again, or until it falls.

    Args:
        world: A world in which the robot stands still.
        robot: The robot.
        impulse: Impulse in odom, (3,) [N s].
        step_change: Whether the push may make the robot step.

    Returns:
        Whether the robot has stepped.
    """
    link = DriverLink(world, robot, recover=step_change)
    link.rest(STANDING)
    world.push_robot(np.array(impulse), PUSH_DURATION)
    link.rest(_STEPS)
    return not math.isnan(link.began)


def _judged(
    robot: RobotModel, execution: Walk, begin: float, plan: WalkPlan,
    log: simulation_log.SimulationLog, pushes: Sequence[Push],
) -> Walked:
    """Measure a walk in the simulation's log."""
    motion = log.motion
    end = Stance(*(
        Pose(float(place[-1, 0]), float(place[-1, 1]), float(turn[-1]))
        for place, turn in ((motion.left_sole, motion.left_heading),
                            (motion.right_sole, motion.right_heading)))).middle
    over = max(1, round(_SPEED_OVER / float(np.median(np.diff(motion.t)))))
    speed = np.abs(motion.joints[over:] - motion.joints[:-over]) / _SPEED_OVER
    return Walked(
        plan=plan, begin=begin, execution=execution, log=log,
        support=evaluation.support(motion, robot.config, window=evaluation.WINDOW),
        off=end.seen_from(plan.stance.middle),
        max_tilt=float(evaluation.tilt(motion.base_orientation).max()),
        speed_share=float((speed / robot.config.velocity_limit).max()),
        pushes=tuple(pushes))
