"""Run a passage in the simulation without nodes: hit and catch, or reach; walk through the door.

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
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY
from door_impact_common.errors import DoorImpactError
from door_model.door.config import DoorConfig, load_door
from hrp2_description.robot import load_robot_config, needed
from hrp2_sim_bridge.world import World
from humanoid_motion.driver_interface import Command, TickSample
from humanoid_motion.kinematics import yaw_of
from humanoid_motion.robot_model import RobotModel
from impact_planner.errors import PlannerError
from impact_planner.impact_plan import ImpactPlan
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.settings import configured_placement
from motion_execution.hit.execution import Execution
from motion_execution.hit.point_b import PointB
from motion_execution.walk.passage import Passage
from motion_execution.walk.reaching import Reaching
from robot_driver.motion import Outcome
from walking.errors import PLANNING_ERRORS, PassageInfeasible
from walking.footsteps.footstep import ORIGIN, Pose, Stance
from walking.passing.approach import AS_SURVEYED, Site, arrived
from walking.passing.doorway import Doorway
from walking.passing.held import HITS, Hold
from walking.passing.opening import Opening, choose_opening
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
        opening: How the leaf was opened, and why.
        hit: Plan of the hit; None if the leaf was pushed from closed.
        plan: The passage that was executed; None if none was.
        record: What was logged, of which `passage_measures` makes the figures.
        why: Sentence that says why the passage did not begin, or ended early; empty if it did not.
    """

    opening: Opening
    hit: ImpactPlan | None
    plan: PassagePlan | None
    record: PassageRecord
    why: str


def pass_door(
    path: Path, hits: Sequence[tuple[float, str]] = HITS, *, door: str | DoorConfig = "paper",
    known: KnownDoor | None = None, door_offset: float = 0.0, run_up: str = "mcv50",
    opening: str = "", passing: PassageSettings | None = None, walk_up_from: Pose = ORIGIN,
    **settings: Any,
) -> Passed:
    """Open a door by a hit or a push, and walk through while the hand holds the leaf.

    Args:
        path: File for the simulation's log.
        hits: Opening angles [rad] and endings of a hit, tried until a passage can be planned.
        door: The simulated door, or its name or file.
        known: What the planner knows of the door; None means that it knows the configured door.
        door_offset: Distance by which the door stands farther away than surveyed [m].
        run_up: Profile of the run-up, mcv50 or zmp_limited.
        opening: How the door is opened, hit or push; empty: a light door is pushed.
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
    passing, passage, begin = passing or PassageSettings(), None, math.nan

    def planned(site: Site) -> _Way:
        return _way(robot, known, hits, run_up, opening, passing, site)

    way = planned(AS_SURVEYED)
    world = rehearsal.world_of(robot, config, way.hold.doorway.hinge, door_offset,
                               start=tuple(walk_up_from), **settings)
    try:
        encoder = rehearsal.DoorEncoder(world.settings.encoder_bits)
        walked: list[float] = []
        if walk_up_from != ORIGIN:
            ahead = 0.0 if way.hit is None else float(way.hit.contact_point[0])
            site, up = _walked_up(world, robot, ahead, walk_up_from)
            walked.append(up)
            way = planned(site)
        opened = _opened(way, world, robot, passing, encoder)
        why = world.fall.reason or opened.why
        if not why:
            last = world.step()
            encoder.take(last)
            try:
                plan = plan_passage(robot, way.hold.found(
                    last.position, way.hold.stance, opened.angle, world.commanded,
                    np.asarray(last.imu.orientation)), passing, way.passage)
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
    return Passed(way.opening, way.hit, None if passage is None else passage.passage,
                  _record(robot, way.hit, opened, log, walk, walked), why)


def _walked_up(
    world: World, robot: RobotModel, ahead: float, start: Pose
) -> tuple[Site, float]:
    """Let a robot walk to where a hit begins.

    Args:
        ahead: Distance of the place of the hit ahead of the soles [m].

    Returns:
        How it sees the door from there, by its odometry, and when the walk began [s].
    """
    soles = dict[str, Pose]()
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
    return arrived(ORIGIN, Stance(**soles).middle, _survey(), ahead), begin


def _survey() -> Pose:
    place = configured_placement()
    return Pose(place["hinge_x"], -place["door_distance"], 0.0)


@dataclass(frozen=True)
class _Way:
    """A way through the closed door: a push, or a hit.

    Attributes:
        opening: How the door is opened, and why.
        hold: How the hand comes to the leaf, as it is planned.
        passage: The passage from there.
        site: Where it is opened.
        hit: Plan of the hit; None if there is none.
    """

    opening: Opening
    hold: Hold
    passage: PassagePlan
    site: Site
    hit: ImpactPlan | None = None


def _way(
    robot: RobotModel, known: KnownDoor, hits: Sequence[tuple[float, str]], run_up: str,
    wanted: str, passing: PassageSettings, site: Site,
) -> _Way:
    """Choose between hit and push, and plan it; errors as of `pass_door`."""
    soles = Stance.around(site.soles, needed(robot.config.footsteps, "footsteps").width)
    opening = choose_opening(robot, known.door, _doorway(known, np.array(_survey()[:2])), soles,
                             wanted, passing)
    if opening.push is not None:
        return _Way(opening, opening.push.hold, opening.push.passage, site)
    hit, hold, passage = _planned(robot, known, hits, run_up, passing, site)
    return _Way(opening, hold, passage, site, hit)


def _planned(
    robot: RobotModel, known: KnownDoor, hits: Sequence[tuple[float, str]], run_up: str,
    passing: PassageSettings, site: Site,
) -> tuple[ImpactPlan, Hold, PassagePlan]:
    """Plan the first hit from whose end a passage can be planned; errors as of `pass_door`."""
    place = {} if site == AS_SURVEYED else dict(
        zip(("door_distance", "l_b"), site.seen, strict=True))
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
    left, right, b = (site.soles.moved(float(place[0]), float(place[1]))
                      for place in (hit.left_foot, hit.right_foot, hit.contact_point))
    return Hold(known.door, _doorway(known, np.array([b.x - hit.l_b, b.y])),
                hit.held_angle, Stance(left, right), hit.phases[-1].knots.position[-1])


def _doorway(known: KnownDoor, hinge: Array) -> Doorway:
    """Put a door's leaf and frame where its hinge is, (2,) [m]; errors as of `_hold_of`."""
    if known.frame is None:
        raise PassageInfeasible(f"the frame of the door {known.name} is not known",
                                quantity=_FRAME, value="none", limit="a frame")
    return Doorway(hinge, *known.frame)


@dataclass(frozen=True)
class _Opened:
    """The robot that has its hand on the leaf.

    Attributes:
        first_motion: Time of its first motion [s].
        angle: Angle of the leaf [rad].
        why: Sentence that says why the hand is not there; empty if it is.
        hit: Execution of the hit; None if there was none.
    """

    first_motion: float
    angle: float
    why: str
    hit: Execution | None = None


def _opened(
    way: _Way, world: World, robot: RobotModel, settings: PassageSettings,
    encoder: rehearsal.DoorEncoder,
) -> _Opened:
    """Hit the door and catch the leaf, or put the hand on the closed leaf."""
    if way.hit is not None:
        done = rehearsal.execute(
            world, way.hit, PointB(robot), lambda *_: None, None, probe=not way.site.certain,
            encoder=encoder, afterwards=_PAUSE)
        why = "" if done.outcome is Outcome.SUCCESS else done.reason or "the hit has not ended"
        return _Opened(min(done.starts.values(), default=math.nan), done.door_angle, why, done)
    assert way.opening.push is not None, "neither hit nor push"
    reach = way.opening.push.reach
    reaching = Reaching(robot, reach)
    events = _Events(world, reaching, settings, encoder)
    _, begin = walk_run.execute(world, robot, reach.walk, step_change=False, execution=reaching,
                                events=events, afterwards=0.0)
    rested = world.time + _PAUSE
    while world.time < rested and not world.fell:
        events(world.step())
    return _Opened(begin, events.angle, reaching.reason)


class _Events:
    """Tells a motion of door and hand, and lets the hand yield while the motion asks for it."""

    def __init__(
        self, world: World, passage: Passage | Reaching, settings: PassageSettings,
        encoder: rehearsal.DoorEncoder,
    ) -> None:
        self._world, self._passage, self._settings = world, passage, settings
        self._encoder, self._yields = encoder, False
        self.angle = 0.0  # of the door at last [rad]

    def __call__(self, sample: TickSample) -> Sequence[Command]:
        passage, settings, commands = self._passage, self._settings, list[Command]()
        yields = settings.yields and passage.yields_at(sample.time)
        if yields != self._yields:
            self._world.comply("right", *(settings.impedance if yields else ()))
            self._yields = yields
        if sample.right_hand_wrench is not None:
            commands += passage.on_hand(
                sample.time, float(np.linalg.norm(sample.right_hand_wrench[:3])))
        for point in self._encoder.take(sample):
            self.angle = point.theta
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
    robot: RobotModel, hit: ImpactPlan | None, opened: _Opened, log: simulation_log.SimulationLog,
    walk: WalkedThrough | None, walked: Sequence[float],
) -> PassageRecord:
    impact = None if hit is None or opened.hit is None else rehearsal.impact_of(
        hit, opened.hit, log)
    margin = evaluation.support(log.motion, robot.config, window=evaluation.WINDOW).margin
    first = min([*walked, opened.first_motion])
    contact, peak = (math.nan, math.nan) if impact is None else (
        float(log.motion.t[impact.contact.start]), float(log.motion.t[impact.peak]))
    return PassageRecord(log, margin, first, contact, peak, walk)
