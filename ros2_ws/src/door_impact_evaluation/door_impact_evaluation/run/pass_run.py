"""Run a passage in the simulation without nodes: hit and catch, or reach; walk through the door.

The passage is planned twice: from what is known before the robot moves, so that a door that cannot
be passed is refused, and anew from what the robot knows when its hand holds the leaf.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.errors import DoorImpactError
from door_model.door.config import DoorConfig, load_door
from hrp2_description.robot import load_robot_config, needed
from hrp2_sim_bridge.world import World
from humanoid_motion.driver_interface import Command, TickSample
from humanoid_motion.robot_model import RobotModel
from impact_planner.errors import PlannerError
from impact_planner.execution.execution import Execution, Outcome
from impact_planner.execution.point_b import PointB
from impact_planner.impact_plan import ImpactPlan
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.settings import configured_placement
from walking.errors import PLANNING_ERRORS, PassageInfeasible
from walking.execution.passage import Passage
from walking.execution.reaching import Reaching
from walking.footsteps.footstep import ORIGIN, Pose, Stance
from walking.passing.doorway import Doorway
from walking.passing.held import HITS, Hold
from walking.passing.opening import Opening, choose_opening
from walking.passing.passage import PassagePlan, plan_passage
from walking.passing.reach import Reach
from walking.passing.route import OPENING
from walking.passing.settings import PassageSettings

from door_impact_evaluation.run import evaluation, rehearsal, simulation_log, walk_run
from door_impact_evaluation.run.body_distances import body_distances
from door_impact_evaluation.run.passage_measures import PassageRecord, WalkedThrough

_FRAME = "frame"  # quantity of the error of a door without one
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
    opening: str = "", passing: PassageSettings | None = None, **settings: Any,
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
        settings: Settings of the simulated world (`WorldSettings`).

    Raises:
        PlannerError: There is no plan of the hit.
        PLANNING_ERRORS: There is no plan of a passage before the robot has moved.
        SettingError: A setting of the world is out of its range.
    """
    config = load_door(door) if isinstance(door, str) else door
    robot, known = RobotModel(load_robot_config()), known or KnownDoor.configured(config)
    passing, hit, passage, begin = passing or PassageSettings(), None, None, math.nan
    choice = _chosen(robot, known, opening, passing)
    if choice.push is None:
        hit, hold = _planned(robot, known, hits, run_up, passing)
        opens = partial(_hit, hit)
    else:
        hold, opens = choice.push.hold, partial(_reached, choice.push.reach, passing)
    world = rehearsal.world_of(robot, config, hold.doorway.hinge, door_offset, **settings)
    try:
        encoder = rehearsal.DoorEncoder(world.settings.encoder_bits)
        opened = opens(world, robot, encoder)
        why = world.fall.reason or opened.why
        if not why:
            last = world.step()
            encoder.take(last)
            try:
                plan = plan_passage(robot, hold.found(
                    last.position, hold.stance, opened.angle, world.commanded,
                    np.asarray(last.imu.orientation)), passing)
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
    return Passed(choice, hit, None if passage is None else passage.passage,
                  _record(robot, hit, opened, log, walk), why)


def _chosen(
    robot: RobotModel, known: KnownDoor, wanted: str, passing: PassageSettings
) -> Opening:
    """Choose between hit and push from where a hit begins; errors as of `pass_door`."""
    place = configured_placement()
    doorway = _doorway(known, np.array([place["hinge_x"], -place["door_distance"]]))
    soles = Stance.around(ORIGIN, needed(robot.config.footsteps, "footsteps").width)
    return choose_opening(robot, known.door, doorway, soles, wanted, passing)


def _planned(
    robot: RobotModel, known: KnownDoor, hits: Sequence[tuple[float, str]], run_up: str,
    passing: PassageSettings,
) -> tuple[ImpactPlan, Hold]:
    """Plan the first hit from whose end a passage can be planned; errors as of `pass_door`."""
    refused: DoorImpactError | None = None
    for angle, ending in hits:
        try:
            hit = rehearsal.planned(robot, known, math.degrees(angle), run_up, ending)
            hold = _hold_of(hit, known)
            plan_passage(robot, hold.task(), passing)
            return hit, hold
        except (PlannerError, *PLANNING_ERRORS) as error:
            refused = refused or error
            if error.quantity in (OPENING, _FRAME):
                break  # no other hit is a remedy
    assert refused is not None, "no angle is tried"
    raise refused


def _hold_of(hit: ImpactPlan, known: KnownDoor) -> Hold:
    """Describe how a hit is planned to end.

    Raises:
        PassageInfeasible: The door's frame is not known.
    """
    left, right = (Pose(float(sole[0]), float(sole[1]), 0.0)
                   for sole in (hit.left_foot, hit.right_foot))
    return Hold(known.door, _doorway(known, hit.hit.placement.hinge),
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


def _hit(
    hit: ImpactPlan, world: World, robot: RobotModel, encoder: rehearsal.DoorEncoder
) -> _Opened:
    """Hit the door and catch the leaf."""
    done = rehearsal.execute(
        world, hit, PointB(robot), lambda *_: None, None, encoder=encoder, afterwards=_PAUSE)
    why = "" if done.outcome is Outcome.SUCCESS else done.reason or "the hit has not ended"
    return _Opened(min(done.starts.values(), default=math.nan), done.door_angle, why, done)


def _reached(
    reach: Reach, settings: PassageSettings, world: World, robot: RobotModel,
    encoder: rehearsal.DoorEncoder,
) -> _Opened:
    """Put the hand on the closed leaf."""
    done = Reaching(robot, reach)
    events = _Events(world, done, settings, encoder)
    _, begin = walk_run.execute(world, robot, reach.walk, step_change=False, execution=done,
                                events=events, afterwards=0.0)
    rested = world.time + _PAUSE
    while world.time < rested and not world.fell:
        events(world.step())
    return _Opened(begin, events.angle, done.reason)


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
            self._world.comply("right", *(
                (settings.hand_stiffness, settings.hand_damping, settings.hand_mass) if yields
                else ()))
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
    walk: WalkedThrough | None,
) -> PassageRecord:
    impact = None if hit is None or opened.hit is None else rehearsal.impact_of(
        hit, opened.hit, log)
    margin = evaluation.support(log.motion, robot.config, window=evaluation.WINDOW).margin
    contact, peak = (math.nan, math.nan) if impact is None else (
        float(log.motion.t[impact.contact.start]), float(log.motion.t[impact.peak]))
    return PassageRecord(log, margin, opened.first_motion, contact, peak, walk)
