"""Run a passage in the simulation without nodes: hit, catch, walk through the door.

The passage is planned twice: from what is known before the robot moves, so that a door that cannot
be passed is refused, and anew from what the robot knows when its hand holds the leaf. A robot that
stands elsewhere walks up to the hit first.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.constants import GRAVITY
from door_impact_common.errors import DoorImpactError
from door_model.door.config import DoorConfig, load_door
from hrp2_description.robot import load_robot_config
from hrp2_sim_bridge.world import World
from humanoid_motion.driver_interface import Command, TickSample
from humanoid_motion.kinematics import yaw_of
from humanoid_motion.robot_model import RobotModel
from impact_planner.errors import PlannerError
from impact_planner.execution.execution import Execution, Outcome
from impact_planner.execution.point_b import PointB
from impact_planner.impact_plan import ImpactPlan
from impact_planner.task.known_door import KnownDoor
from walking.errors import PLANNING_ERRORS, PassageInfeasible
from walking.execution.passage import Passage
from walking.footsteps.footstep import ORIGIN, Pose, Stance
from walking.passing.approach import AS_SURVEYED, Site, arrived
from walking.passing.doorway import Doorway
from walking.passing.held import HITS, Hold
from walking.passing.passage import PassagePlan, plan_passage
from walking.passing.route import OPENING
from walking.passing.settings import PassageSettings
from zmp_publisher.odometry import FootOdometry

from door_impact_evaluation.run import evaluation, rehearsal, simulation_log, walk_run
from door_impact_evaluation.run.body_distances import body_distances
from door_impact_evaluation.run.passage_measures import PassageRecord, WalkedThrough

_FRAME = "frame"  # quantity of the error of a door without one
_LOADED = 0.05  # share of the weight above which a sole bears load, as of zmp_publisher
_PAUSE = 0.3  # simulated time at rest with the hand on the leaf before the passage is planned [s]


@dataclass(frozen=True)
class Passed:
    """A passage and its results.

    Attributes:
        hit: Plan of the hit.
        plan: The passage that was executed; None if none was.
        record: What was logged, of which `passage_measures` makes the figures.
        why: Sentence that says why the passage did not begin, or ended early; empty if it did not.
    """

    hit: ImpactPlan
    plan: PassagePlan | None
    record: PassageRecord
    why: str


def pass_door(
    path: Path, hits: Sequence[tuple[float, str]] = HITS, *, door: str | DoorConfig = "paper",
    known: KnownDoor | None = None, door_offset: float = 0.0, run_up: str = "mcv50",
    passing: PassageSettings | None = None, walk_up_from: Pose = ORIGIN, **settings: Any,
) -> Passed:
    """Open a door by a hit, and walk through while the hand holds the leaf.

    Args:
        path: File for the simulation's log.
        hits: Opening angles [rad] and endings of a hit, tried until a passage can be planned.
        door: The simulated door, or its name or file.
        known: What the planner knows of the door; None means that it knows the configured door.
        door_offset: Distance by which the door stands farther away than surveyed [m].
        run_up: Profile of the run-up, mcv50 or zmp_limited.
        passing: Settings of the passage; None means the defaults.
        walk_up_from: Where the robot stands at first in odom; elsewhere than where the hit begins,
            it walks there, and touches the leaf before the hit.
        settings: Settings of the simulated world (`WorldSettings`) except its `start`.

    Raises:
        PlannerError: There is no plan of the hit.
        PLANNING_ERRORS: There is no plan of a passage before the hit, or the robot has not got to
            the door.
        SettingError: A setting of the world is out of its range.
    """
    config = load_door(door) if isinstance(door, str) else door
    robot, known = RobotModel(load_robot_config()), known or KnownDoor.configured(config)
    passing = passing or PassageSettings()
    site, walked = AS_SURVEYED, []
    hit, hold, before = _planned(robot, known, hits, run_up, passing, site)
    passage, begin = None, math.nan
    world = rehearsal.world_of(
        robot, config, hit, door_offset, start=tuple(walk_up_from), **settings)
    try:
        last: list[TickSample] = []

        def keep(_: World, sample: TickSample) -> None:
            last[:] = [sample]

        encoder = rehearsal.DoorEncoder(world.settings.encoder_bits)
        if walk_up_from != ORIGIN:
            site, up = _walked_up(world, robot, hit, walk_up_from)
            walked.append(up)
            hit, hold, before = _planned(robot, known, hits, run_up, passing, site)
        execution = rehearsal.execute(
            world, hit, PointB(robot), keep, None, probe=not site.certain, encoder=encoder,
            afterwards=_PAUSE)
        why = world.fall.reason or execution.reason
        if execution.outcome is Outcome.SUCCESS and not world.fell:
            try:
                plan = plan_passage(robot, hold.found(
                    last[0].position, hold.stance, execution.door_angle, world.commanded,
                    np.asarray(last[0].imu.orientation)), passing, before)
                passage = Passage(robot, plan, yields=passing.yields)
                _, begin = walk_run.execute(
                    world, robot, plan.walk, step_change=False, execution=passage,
                    events=_Events(world, passage, passing, encoder))
                why = world.fall.reason or passage.reason
            except PLANNING_ERRORS as error:
                why = str(error)
        log = simulation_log.load(world.save_log(path), 0.0)
    finally:
        world.close()
    walk = None if passage is None else _walked(robot, passage, begin, config, log)
    return Passed(hit, None if passage is None else passage.passage,
                  _record(robot, hit, execution, log, walk, walked), why)


def _walked_up(
    world: World, robot: RobotModel, hit: ImpactPlan, start: Pose
) -> tuple[Site, float]:
    """Let a robot walk to where a hit begins.

    Returns:
        How it sees the door from there, by its odometry, and when the walk began [s].
    """
    place, soles = hit.hit.placement, dict[str, Pose]()
    odometry = FootOdometry(robot, loaded_force=_LOADED * robot.mass * GRAVITY, start=start)

    def follow(sample: TickSample) -> Sequence[Command]:
        forces = {"left": float(sample.left_wrench[2]), "right": float(sample.right_wrench[2])}
        pose = odometry.update(sample.position, forces, sample.imu, sample.time)
        if pose is not None:
            soles.update({side: Pose(float(sole[0, 3]), float(sole[1, 3]), yaw_of(sole))
                          for side, sole in pose.soles.items()})
        return ()

    plan = walk_run.plan_between(robot, start, ORIGIN)
    _, begin = walk_run.execute(world, robot, plan, events=follow)
    return arrived(ORIGIN, Stance(**soles).middle, Pose(place.hinge_x, -place.door_distance, 0.0),
                   float(hit.contact_point[0])), begin


def _planned(
    robot: RobotModel, known: KnownDoor, hits: Sequence[tuple[float, str]], run_up: str,
    passing: PassageSettings, site: Site,
) -> tuple[ImpactPlan, Hold, PassagePlan]:
    """Plan the first hit from whose end a passage can be planned; errors as of `pass_door`."""
    place = {} if site == AS_SURVEYED else dict(zip(("door_distance", "l_b"), site.seen, strict=True))
    refused: DoorImpactError | None = None
    for angle, ending in hits:
        try:
            hit = rehearsal.planned(robot, known, math.degrees(angle), run_up, ending, **place)
            hold = hold_of(hit, known, site)
            return hit, hold, plan_passage(robot, hold.task(), passing)
        except (PlannerError, *PLANNING_ERRORS) as error:
            refused = refused or error
            if error.quantity in (OPENING, _FRAME):
                break  # no other hit is a remedy
    assert refused is not None, "no angle is tried"
    raise refused


def hold_of(hit: ImpactPlan, known: KnownDoor, site: Site = AS_SURVEYED) -> Hold:
    """Describe how a hit is planned to end.

    Raises:
        PassageInfeasible: The door's frame is not known.
    """
    if known.frame is None:
        raise PassageInfeasible(f"the frame of the door {known.name} is not known",
                                quantity=_FRAME, value="none", limit="a frame")
    left, right, b = (site.soles.moved(float(place[0]), float(place[1]))
                      for place in (hit.left_foot, hit.right_foot, hit.contact_point))
    return Hold(known.door, Doorway(np.array([b.x - hit.l_b, b.y]), *known.frame),
                hit.held_angle, Stance(left, right), hit.phases[-1].knots.position[-1])


class _Events:
    """Tells a passage of door and hand, and lets the hand yield while the passage asks for it."""

    def __init__(
        self, world: World, passage: Passage, settings: PassageSettings,
        encoder: rehearsal.DoorEncoder,
    ) -> None:
        self._world, self._passage, self._settings = world, passage, settings
        self._encoder, self._yields = encoder, False

    def __call__(self, sample: TickSample) -> Sequence[Command]:
        passage, settings, commands = self._passage, self._settings, list[Command]()
        yields = settings.yields and passage.yields_at(sample.time)
        if yields != self._yields:
            self._world.comply("right", *(
                (settings.hand_stiffness, settings.hand_damping, settings.hand_mass) if yields
                else ()))
            self._yields = yields
        if sample.right_hand_wrench is not None:
            commands += passage.on_hand(
                sample.time, float(np.linalg.norm(sample.right_hand_wrench[:3])))
        for point in self._encoder.take(sample):
            commands += passage.on_door(1e-9 * point.stamp_ns, point.theta, point.omega)
        return commands


def _walked(
    robot: RobotModel, passage: Passage, begin: float, door: DoorConfig,
    log: simulation_log.SimulationLog,
) -> WalkedThrough:
    push, motion = passage.passage.push, log.motion
    return WalkedThrough(
        begin, begin + push.release, len(passage.plan.footsteps), push.at(motion.t - begin),
        body_distances(robot, motion, door, (log.hinge_x, -log.door_distance), begin))


def _record(
    robot: RobotModel, hit: ImpactPlan, execution: Execution, log: simulation_log.SimulationLog,
    walk: WalkedThrough | None, walked: Sequence[float],
) -> PassageRecord:
    impact, t = rehearsal.impact_of(hit, execution, log), log.motion.t
    margin = evaluation.support(log.motion, robot.config, window=evaluation.WINDOW).margin
    first = min([*walked, *execution.starts.values()], default=math.nan)
    contact, peak = (math.nan, math.nan) if impact is None else (
        float(t[impact.contact.start]), float(t[impact.peak]))
    return PassageRecord(log, margin, first, contact, peak, walk)
