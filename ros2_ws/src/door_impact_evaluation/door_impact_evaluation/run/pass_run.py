"""Run a passage in the simulation without nodes: the mission of the nodes, driver, physics."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from door_impact_common.errors import DoorImpactError
from door_model.door.config import DoorConfig, load_door
from hrp2_description.robot import load_robot_config
from humanoid_motion.robot_model import RobotModel
from impact_planner.impact_plan import ImpactPlan
from impact_planner.task.known_door import KnownDoor
from motion_execution.hit.execution import Execution
from motion_execution.mission.mission import PASSAGE
from motion_execution.mission.order import Order
from motion_execution.mission.passing import Passed as Done
from motion_execution.mission.ways import Wanted
from motion_execution.walk.passage import Passage
from walking.errors import NotReached
from walking.footsteps.footstep import ORIGIN, Pose
from walking.passing.held import HITS
from walking.passing.opening import Opening
from walking.passing.passage import PassagePlan
from walking.passing.settings import PassageSettings

from door_impact_evaluation.run import evaluation, rehearsal, simulation_log
from door_impact_evaluation.run.body_distances import body_distances
from door_impact_evaluation.run.driver_link import DriverLink
from door_impact_evaluation.run.passage_measures import PassageRecord, WalkedThrough

LONGEST = 120.0  # simulated time after which a run ends [s]


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
    probe: str = "auto", robot: RobotModel | None = None, **settings: Any,
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
        probe: Whether the leaf is touched slowly before a hit: auto, on or off.
        robot: The robot; None means HRP-2.
        settings: Settings of the simulated world (`WorldSettings`) except its `start`.

    Raises:
        DoorImpactError: There is no way through the door, or the robot has not got to it.
        SettingError: A setting of the world is out of its range.
    """
    config = load_door(door) if isinstance(door, str) else door
    robot, done, why = robot or RobotModel(load_robot_config()), Done(), ""
    world = rehearsal.world_of(robot, config, door_offset, start=tuple(walk_up_from), **settings)
    try:
        link = DriverLink(
            world, robot, known or KnownDoor.configured(config), start=walk_up_from,
            passing=passing, encoder_bits=world.settings.encoder_bits)
        wanted = Wanted(run_up=run_up, opening=opening, probe=probe, hits=tuple(hits))
        try:
            link.run(link.mission.pass_door(wanted, Order(PASSAGE), done), LONGEST)
        except DoorImpactError as error:
            if done.way is None:
                raise
            why = str(error)
        log = simulation_log.load(world.save_log(path), 0.0)
    finally:
        world.close()
    motion, way, passage = link.mission.body.motion, done.way, done.passage
    if way is None:
        raise NotReached(f"the robot has not got to the door: {world.fall.reason}")
    hit = done.hit or (motion if isinstance(motion, Execution) else None)
    plan = None if way.hit is None else link.plans[way.hit.plan_id]
    why = world.fall.reason or why or ("" if passage is None else passage.reason)
    return Passed(
        way.opening, plan, None if passage is None else passage.passage,
        _record(robot, config, log, link.began, passage, plan, hit), why)


def _walked(
    robot: RobotModel, passage: Passage, door: DoorConfig, log: simulation_log.SimulationLog,
) -> WalkedThrough:
    push, motion, begin = passage.passage.push, log.motion, -passage.since(0.0)
    return WalkedThrough(
        begin, begin + push.release, len(passage.plan.footsteps), push.at(motion.t - begin),
        body_distances(robot, motion, door, (log.hinge_x, -log.door_distance), begin))


def _record(
    robot: RobotModel, door: DoorConfig, log: simulation_log.SimulationLog, began: float,
    passage: Passage | None, plan: ImpactPlan | None, hit: Execution | None,
) -> PassageRecord:
    impact = None if plan is None or hit is None else rehearsal.impact_of(plan, hit, log)
    margin = evaluation.support(log.motion, robot.config, window=evaluation.WINDOW).margin
    contact, peak = (math.nan, math.nan) if impact is None else (
        float(log.motion.t[impact.contact.start]), float(log.motion.t[impact.peak]))
    return PassageRecord(log, margin, began, contact, peak, None if passage is None else _walked(
        robot, passage, door, log))
