"""A hit, a walk or a passage in the simulation that can be disturbed, without processes.

World, sensors, encoder, checks of the inputs and execution are those of the nodes. What lies
between them, messages that are underway, is here, so that every fault happens at its instant on any
machine. The simulation is copied (fork) at the begin of each fault.
"""

import multiprocessing
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_impact_evaluation.run import evaluation, rehearsal, simulation_log
from door_impact_evaluation.run.pass_run import hold_of
from door_impact_evaluation.run.rehearsal import DoorEncoder, arrays_of
from door_impact_evaluation.run.walk_run import plan_between
from door_model.door.config import load_door
from hrp2_description.robot import load_robot_config
from hrp2_sim_bridge.errors import TrajectoryRefusedError
from hrp2_sim_bridge.settings import WorldSettings
from hrp2_sim_bridge.world import World
from humanoid_motion.driver_interface import Command, ImuSample, TickSample
from humanoid_motion.robot_model import RobotModel
from impact_planner.impact_plan import ImpactPlan
from impact_planner.plan import plan_impact
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest
from impact_planner.task.settings import configured_placement, make_settings
from motion_execution.hit.execution import Execution
from motion_execution.hit.point_b import PointB
from motion_execution.hit.types import ExecutablePlan
from motion_execution.walk.passage import Passage
from motion_execution.walk.walk import Walk
from robot_driver.freshness import Freshness
from robot_driver.inputs import Inputs
from robot_driver.intake import Arrival
from robot_driver.names import DOOR, HAND, IMU, JOINTS, WRENCHES
from robot_driver.ranges import joint_ranges
from walking.footsteps.footstep import Pose
from walking.passing.passage import plan_passage
from walking.passing.settings import PassageSettings

from faults.plan import (
    COMMANDER,
    COMMANDS,
    DRIVER,
    ENCODER,
    HIT,
    LEAF,
    PASSAGE,
    ROBOT,
    TOPICS,
    WALK,
    Fault,
    Verdict,
)

TARGET = np.radians(25.0)
AHEAD = 1.2  # length of the walk [m]
FAR = 2.0  # distance of the door from the walk's begin [m]
QUEUE = 50  # messages of a topic that wait for the executor
WATCH = 0.05  # period of the watch for silent topics [s]
PASSING = PassageSettings()
PAUSE = 0.3  # time at rest with the hand on the leaf, before the passage is planned [s]
AFTERWARDS = {HIT: 2.0, WALK: 2.0, PASSAGE: 6.0}  # time after the end, in which it may fall [s]
LONGEST = 14.0  # time after the planned contact, or walk, at which a run ends in any case [s]
MEAN = 0.02  # time over which the hand's force is averaged [s]
FIRST = 0.1  # time after the first contact that belongs to the hit itself [s]


@dataclass(frozen=True, eq=False)
class Message:
    """A message that is underway; its stamp, and when it was published and arrives [s]."""

    topic: str
    stamp: float
    sent: float
    due: float
    values: tuple[Any, ...]


@dataclass
class Rig:
    """A motion that runs tick by tick."""

    folder: Path  # for logs
    motion: str  # HIT, WALK or PASSAGE, which begins after its hit
    friction: float = WorldSettings.friction  # of the soles
    fault: Fault | None = None
    waiting: list[Message] = field(default_factory=list)
    commands: list[tuple[float, Command]] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)
    happened: bool = False  # whether a fault of a single message has happened
    yields: bool = False  # whether the hand yields
    moves_until: float = 0.0  # end of the driver's last trajectory [s]

    def __post_init__(self) -> None:
        """Plan the motion and start its execution."""
        config, door, placement = load_robot_config(), load_door("paper"), configured_placement()
        robot = RobotModel(config)
        known = KnownDoor.configured(door)
        if self.motion == WALK:
            placement["door_distance"] = FAR
        self.world = World(config, door, placement["door_distance"], placement["hinge_x"],
                           friction=self.friction)
        self.encoder = DoorEncoder(self.world.settings.encoder_bits)
        self.execution: Execution | Walk
        self.warned = False  # whether the plan says that the robot falls if it misses the door
        if self.motion == WALK:
            self.execution = Walk(
                robot, plan_between(robot, Pose(0.0, 0.0, 0.0), Pose(AHEAD, 0.0, 0.0)))
        else:
            plan = plan_impact(
                PlanRequest(TARGET, ending="hold" if self.motion == HIT else "pass"), known, robot,
                make_settings(placement))
            self.warned = not plan.stands_if_missed
            self.execution = self.passage(robot, plan, known) if self.motion == PASSAGE else (
                Execution(
                    ExecutablePlan.of(plan, {each.name: each.knots for each in plan.all_phases}),
                    PointB(robot), joint_names=config.joint_names))
        topics = {HIT: (DOOR,), WALK: (), PASSAGE: (DOOR, HAND)}[self.motion]
        self.watch = Freshness((JOINTS, IMU, *topics), 0.5, WATCH)
        self.inputs = Inputs(joint_ranges(robot), self.watch)
        sample = self.world.step()
        self.encoder.take(sample)
        start = self.execution.start(sample.time)
        self.commands.append((0.0, start))
        self.inputs.motion = self.execution
        self.reference = (  # time of the planned contact, or of the walk's planned end [s]
            self.execution.planned_contact if isinstance(self.execution, Execution)
            else start.stamp + self.execution.plan.duration)
        self.lasts = self.reference - start.stamp  # [s]
        self.watched = self.world.time
        self.handlers: dict[str, Callable[..., list[Command]]] = {
            JOINTS: self.inputs.on_joints, IMU: self.on_imu, DOOR: self.inputs.on_door,
            HAND: self.inputs.on_hand,
            **{topic: partial(self.inputs.on_wrench, side) for side, topic in WRENCHES.items()}}

    def passage(self, robot: RobotModel, hit: ImpactPlan, known: KnownDoor) -> Passage:
        """Hit the door, catch the leaf, and plan the passage from there."""
        samples: list[TickSample] = []
        done = rehearsal.execute(
            self.world, hit, PointB(robot), lambda _, sample: samples.append(sample), None,
            encoder=self.encoder, afterwards=PAUSE)
        hold, last = hold_of(hit, known), samples[-1]
        plan = plan_passage(robot, hold.found(
            last.position, hold.stance, done.door_angle, self.world.commanded,
            np.asarray(last.imu.orientation)), PASSING)
        return Passage(robot, plan, yields=PASSING.yields)

    @property
    def since(self) -> float:
        """Time since the begin of the fault [s]; negative before it."""
        return self.world.time - self.reference - self.fault.begin if self.fault else -1.0

    # -- faults ---------------------------------------------------------------------------------

    def disturbs(self, part: str, kind: str = "") -> bool:
        """Whether the fault disturbs a part now, in the manner of `kind` if it is given."""
        fault = self.fault
        return (fault is not None and fault.part == part and kind in ("", fault.kind)
                and self.since >= 0.0 and (self.since < fault.length or fault.kind == "killed"))

    def changed(self, message: Message) -> Iterator[Message]:
        """The messages that arrive in place of a message."""
        fault = self.fault
        if self.disturbs(DRIVER, "silent"):
            return
        if fault is not None and message.topic == DOOR and self.disturbs(ENCODER):
            if fault.kind == "stopped":
                yield replace(message, due=self.reference + fault.begin + fault.length)
        elif fault is None or not (self.disturbs(message.topic) or (
                fault.part == message.topic and fault.length == 0.0 and self.once())):
            yield message
        elif fault.kind == "delayed":
            yield replace(message, due=message.due + fault.size)
        elif fault.kind == "duplicated":
            yield from (message, message)
        elif fault.kind == "NaN":
            yield replace(message, values=tuple(np.full_like(v, np.nan) for v in message.values))
        elif fault.kind == "forged":
            # The neighbour is faster than the driver, so that the true message is the second one.
            rng = np.random.default_rng(fault.seed)
            error = rng.choice((-1.0, 1.0)) * 10.0 ** rng.uniform(-2.0, 3.0)
            yield replace(message, values=tuple(v + error for v in message.values))
            yield message
        elif fault.kind == "clock step":
            yield replace(message, stamp=message.stamp + fault.size)

    def once(self) -> bool:
        """Whether this is the first call after the begin of the fault."""
        first = self.since >= 0.0 and not self.happened
        self.happened |= first
        return first

    @property
    def killed(self) -> bool:
        """Whether the part that moves the robot is dead."""
        return self.disturbs(COMMANDER[self.motion], "killed")

    # -- one tick -------------------------------------------------------------------------------

    def tick(self) -> None:
        """Step the world, and let the part that moves the robot handle what has arrived."""
        if self.fault is not None and self.fault.part in (LEAF, ROBOT) and self.once():
            self.push(self.fault)
        sample = self.world.step()
        for message in self.messages(sample):
            self.waiting.extend(self.changed(message))
        if self.disturbs(COMMANDER[self.motion], "stopped"):
            self.shorten()
        elif not self.killed:
            self.handle(sample.time)
        if not self.disturbs(DRIVER, "late"):
            self.obey(sample.time)

    def push(self, fault: Fault) -> None:
        """Push leaf or robot as somebody does."""
        if fault.part == LEAF:
            self.world.push_door(fault.size, fault.length)
            return
        angle = np.random.default_rng(fault.seed).uniform(-np.pi, np.pi)
        self.world.push_robot(
            fault.size * np.array([np.cos(angle), np.sin(angle), 0.0]), fault.length)

    def messages(self, sample: TickSample) -> Iterator[Message]:
        """What robot and encoder publish after a tick."""
        now, imu = sample.time, sample.imu
        yield Message(IMU, now, now, now, (
            imu.orientation, imu.angular_velocity, imu.specific_force))
        yield Message(JOINTS, now, now, now, (sample.position, sample.velocity))
        yield Message(WRENCHES["left"], now, now, now, (sample.left_wrench,))
        yield Message(WRENCHES["right"], now, now, now, (sample.right_wrench,))
        if self.motion == PASSAGE:
            yield Message(HAND, now, now, now, (sample.right_hand_wrench,))
        for point in self.encoder.take(sample):
            yield Message(DOOR, 1e-9 * point.stamp_ns, now, now, (point.theta, point.omega))

    def shorten(self) -> None:
        """Drop the oldest messages of a topic beyond the depth of its queue."""
        for topic in TOPICS:
            own = [message for message in self.waiting if message.topic == topic]
            for message in own[:-QUEUE]:
                self.waiting.remove(message)

    def handle(self, now: float) -> None:
        """Their turn: every message that has arrived, then the watch, then stops."""
        arrived = [message for message in self.waiting if message.due <= now]
        self.waiting = [message for message in self.waiting if message.due > now]
        for message in arrived:
            arrival = Arrival(message.stamp, now, now - message.sent)
            self.send(now, self.handlers[message.topic](arrival, *message.values))
        if now >= self.watched + WATCH:
            self.watched = now
            silent = self.watch.tick()
            if silent is not None:
                self.send(now, self.inputs.on_silence(*silent, self.watch.limit))
        if self.fault is not None and self.fault.kind == "asked to stop" and self.once():
            if isinstance(self.execution, Execution):
                self.execution.stop()
            else:
                self.execution.stop("it was asked to stop")
        passage = self.execution
        if isinstance(passage, Passage) and self.yields != (
                passage.running and passage.yields_at(now)):
            self.yields = not self.yields
            self.world.comply("right", *(PASSING.impedance if self.yields else ()))

    def on_imu(self, arrival: Arrival, *reading: Array) -> list[Command]:
        """Handle a reading of the IMU."""
        return self.inputs.on_imu(arrival, ImuSample(*reading))

    def send(self, now: float, commands: list[Command]) -> None:
        """Put commands on their way to the driver."""
        for command in commands:
            if self.disturbs(COMMANDS, "dropped"):
                continue
            late = self.fault.size if self.fault and self.disturbs(COMMANDS, "delayed") else 0.0
            copies = 2 if self.disturbs(COMMANDS, "duplicated") else 1
            self.commands.extend([(now + late, command)] * copies)

    def obey(self, now: float) -> None:
        """The driver's turn: the commands that have arrived."""
        arrived = [command for due, command in self.commands if due <= now]
        self.commands = [(due, command) for due, command in self.commands if due > now]
        for command in arrived:
            try:
                self.world.follow(
                    arrays_of(command, self.world.robot_config.joint_names), command.stamp)
            except TrajectoryRefusedError as error:
                self.refused.append(str(error))
                continue
            begin = command.stamp or now
            self.moves_until = begin + (
                0.0 if command.knots is None else float(command.knots.time[-1]))

    # -- runs -----------------------------------------------------------------------------------

    def run_until(self, end: float) -> None:
        """Run to a time relative to the planned contact or end [s]."""
        while self.world.time < self.reference + end and not self.world.fell:
            self.tick()

    def finish(self, fault: Fault) -> Verdict:
        """Run to the end with a fault, and return what the simulation's truth says."""
        self.fault = fault
        while (self.execution.running and not self.killed) or (
                self.world.time <= self.moves_until):
            if self.world.fell or self.world.time >= self.reference + LONGEST:
                break
            self.tick()
        self.run_until(min(self.world.time - self.reference + AFTERWARDS[self.motion], LONGEST))
        path = self.world.save_log(self.folder / "run.npz")
        log = simulation_log.load(path, 0.0)
        force, time = log.motion.contact_force, log.motion.t
        touches = np.flatnonzero(force > evaluation.CONTACT_FORCE)
        hand = 0.0
        if len(touches):
            width = round(MEAN / float(time[1] - time[0]))
            means = np.convolve(force, np.ones(width) / width, "same")
            hand = float(np.max(means[time > time[touches[0]] + FIRST], initial=0.0))
        return Verdict(
            fault=fault, fell=log.fell, hand=hand, peak=float(log.motion.door_angle.max()),
            outcome=self.execution.outcome.name, reason=self.execution.reason,
            touched=bool(len(touches)), warned=self.warned,
            through=bool(log.motion.base_position[-1, 1] < -log.door_distance),
            noticed=self.inputs.intake.noticed(), refused=self.refused)

    def verdict(self, fault: Fault) -> Verdict:
        """The verdict of a run with a fault, in a copy of this process."""
        self.run_until(fault.begin - 0.01)
        fork = multiprocessing.get_context("fork")
        receiver, sender = fork.Pipe(duplex=False)
        child = fork.Process(target=lambda: sender.send(self.finish(fault)))
        child.start()
        sender.close()
        try:
            found: Verdict = receiver.recv()
        finally:
            child.join()
        return found
