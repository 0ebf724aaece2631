"""A hit, a walk or a passage in the simulation that can be disturbed, without processes.

World, sensors, encoder, checks of the inputs and mission are those of the nodes. What lies between
them, messages that are underway, is here, so that every fault happens at its instant on any
machine. The simulation is copied (fork) at the begin of each fault.
"""

import multiprocessing
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from controller_double import ControllerDouble
from door_impact_evaluation.run import evaluation, simulation_log
from door_impact_evaluation.run.driver_link import DriverLink, Message
from door_model.door.config import load_door
from hrp2_description.robot import load_robot_config
from hrp2_sim_bridge.settings import WorldSettings
from hrp2_sim_bridge.world import World
from humanoid_motion.driver_interface import Command
from humanoid_motion.robot_model import RobotModel
from impact_planner.hit.placement import configured_placement
from impact_planner.motion.missed import needed_reserve
from impact_planner.task.known_door import KnownDoor
from motion_execution.hit.execution import Execution
from motion_execution.mission.link import HitRequest
from motion_execution.mission.order import Order
from motion_execution.mission.passing import Passed
from motion_execution.mission.ways import Wanted
from motion_execution.walk.goal import WalkGoal
from motion_execution.walk.passage import Passage
from motion_execution.walk.stepping import Stepping
from motion_execution.walk.walk import Walk
from robot_driver.names import DOOR
from walking.footsteps.footstep import Pose
from walking.passing.opening import HIT as BY_HIT

from faults.plan import (
    COMMANDS,
    DRIVER,
    ENCODER,
    HIT,
    LEAF,
    PASSAGE,
    ROBOT,
    SERVER,
    TOPICS,
    WALK,
    Fault,
    Verdict,
)

TARGET = float(np.radians(25.0))
AHEAD = Pose(1.2, 0.0, 0.0)  # goal of the walk
FAR = 2.0  # distance of the door from the walk's begin [m]
QUEUE = 50  # messages of a topic that wait for the node
MOTIONS = {HIT: Execution, WALK: Walk, PASSAGE: Passage}
AFTERWARDS = {HIT: 2.0, WALK: 2.0, PASSAGE: 6.0}  # time after the end, in which it may fall [s]
LONGEST = 14.0  # time after the planned contact, or walk, at which a run ends in any case [s]
MEAN = 0.02  # time over which the hand's force is averaged [s]
FIRST = 0.1  # time after the first contact that belongs to the hit itself [s]


class Rig(DriverLink):
    """A motion that runs tick by tick.

    Args:
        folder: For logs.
        motion: HIT, WALK, or PASSAGE, which begins after its hit.
        friction: Of the soles.
    """

    def __init__(
        self, folder: Path, motion: str, friction: float = WorldSettings.friction
    ) -> None:
        """Let the mission begin the motion."""
        config, door = load_robot_config(), load_door("paper")
        place = configured_placement(RobotModel(config))
        self.folder, self.motion = folder, motion
        self.fault: Fault | None = None
        self.waiting: list[tuple[float, float, Message]] = []  # when due, when sent [s]
        self.commands: list[tuple[float, Command]] = []
        self.happened = False  # whether a fault of a single message has happened
        self.moves_until = 0.0  # end of the driver's last trajectory [s]
        self.world = World(config, door, FAR if motion == WALK else place.door_distance,
                           place.hinge_x, friction=friction)
        # A stock controller follows whatever reaches it; ours would refuse some of it.
        self.world.driver = ControllerDouble(self.world.driver.limits, self.world.commanded)
        self.world.driver.reset(self.world.driver.sample(0.0).position, self.world.time)
        super().__init__(self.world, RobotModel(config), KnownDoor.configured(door))
        order, passed, mission = Order(motion), Passed(), self.mission
        if motion == HIT:
            plan = self.plan_hit(HitRequest(TARGET, "hold", "", -1.0, -1.0)).result()
            self.begin(mission.hit(plan, order, probe="off"))
        elif motion == WALK:
            self.begin(mission.walk(WalkGoal(AHEAD), order))
        else:
            self.begin(mission.pass_door(Wanted(
                opening=BY_HIT, hits=((TARGET, "pass"),), probe="off"), order, passed))
        # Whether the plan says that the robot falls if it misses the door.
        needed = needed_reserve(config)
        self.warned = any(not each.missed_margin >= needed for each in self.plans.values())

    def begin(self, coroutine: Any) -> None:
        """Step until the mission has begun the motion."""
        routine, body = self.mission.run(coroutine), self.mission.body
        while not isinstance(body.motion, MOTIONS[self.motion]):
            assert not routine.done, routine.result()
            self.step()
        self.execution = body.motion
        begin = -self.execution.since(0.0) if isinstance(self.execution, Stepping) else self.now()
        self.reference = (  # time of the planned contact, or of the walk's planned end [s]
            begin + self.execution.plan.duration if isinstance(self.execution, Stepping)
            else self.execution.planned_contact)
        self.lasts = self.reference - begin  # [s]

    @property
    def since(self) -> float:
        """Time since the begin of the fault [s]; negative before it."""
        return self.now() - self.reference - self.fault.begin if self.fault else -1.0

    # -- faults ---------------------------------------------------------------------------------

    def disturbs(self, part: str, kind: str = "") -> bool:
        """Whether the fault disturbs a part now, in the manner of `kind` if it is given."""
        fault = self.fault
        return (fault is not None and fault.part == part and kind in ("", fault.kind)
                and self.since >= 0.0 and (self.since < fault.length or fault.kind == "killed"))

    def changed(self, message: Message) -> Iterator[tuple[float, Message]]:
        """The messages that arrive in place of a message, and when [s]."""
        fault, now = self.fault, self.now()
        if self.disturbs(DRIVER, "silent"):
            return
        if fault is not None and message.topic == DOOR and self.disturbs(ENCODER):
            if fault.kind == "stopped":
                yield self.reference + fault.begin + fault.length, message
        elif fault is None or not (self.disturbs(message.topic) or (
                fault.part == message.topic and fault.length == 0.0 and self.once())):
            yield now, message
        elif fault.kind == "delayed":
            yield now + fault.size, message
        elif fault.kind == "duplicated":
            yield from ((now, message), (now, message))
        elif fault.kind == "NaN":
            yield now, replace(message, values=tuple(
                np.full_like(v, np.nan) for v in message.values))
        elif fault.kind == "forged":
            # The neighbour is faster than the driver, so that the true message is the second one.
            rng = np.random.default_rng(fault.seed)
            error = rng.choice((-1.0, 1.0)) * 10.0 ** rng.uniform(-2.0, 3.0)
            yield now, replace(message, values=tuple(v + error for v in message.values))
            yield now, message
        elif fault.kind == "clock step":
            yield now, replace(message, stamp=message.stamp + fault.size)

    def once(self) -> bool:
        """Whether this is the first call after the begin of the fault."""
        first = self.since >= 0.0 and not self.happened
        self.happened |= first
        return first

    @property
    def killed(self) -> bool:
        """Whether the node that moves the robot is dead."""
        return self.disturbs(SERVER, "killed")

    # -- one tick -------------------------------------------------------------------------------

    def step(self) -> None:
        """Step the world, and let the mission handle what has arrived."""
        if self.fault is not None and self.fault.part in (LEAF, ROBOT) and self.once():
            self.push(self.fault)
        sample = self.world.step()
        self.waiting += [(due, sample.time, changed) for message in self.messages(sample)
                         for due, changed in self.changed(message)]
        if self.disturbs(SERVER, "stopped"):
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

    def shorten(self) -> None:
        """Drop the oldest messages of a topic beyond the depth of its queue."""
        for topic in TOPICS:
            own = [each for each in self.waiting if each[2].topic == topic]
            for each in own[:-QUEUE]:
                self.waiting.remove(each)

    def handle(self, now: float) -> None:
        """The mission's turn: every message that has arrived, then the watch, then stops."""
        arrived = [each for each in self.waiting if each[0] <= now]
        self.waiting = [each for each in self.waiting if each[0] > now]
        for _, sent, message in arrived:
            self.take(message, now - sent)
        self.look()
        if self.fault is not None and self.fault.kind == "asked to stop" and self.once():
            self.mission.stop()

    def send(self, command: Command) -> None:
        """Put a command on its way to the driver."""
        if self.disturbs(COMMANDS, "dropped"):
            return
        late = self.fault.size if self.fault and self.disturbs(COMMANDS, "delayed") else 0.0
        copies = 2 if self.disturbs(COMMANDS, "duplicated") else 1
        self.commands.extend([(self.now() + late, command)] * copies)

    def obey(self, now: float) -> None:
        """The driver's turn: the commands that have arrived."""
        arrived = [command for due, command in self.commands if due <= now]
        self.commands = [(due, command) for due, command in self.commands if due > now]
        for command in arrived:
            refused = len(self.refused)
            super().send(command)
            if len(self.refused) == refused:
                self.moves_until = (command.stamp or now) + (
                    0.0 if command.knots is None else float(command.knots.time[-1]))

    # -- runs -----------------------------------------------------------------------------------

    def run_until(self, end: float) -> None:
        """Run to a time relative to the planned contact or end [s]."""
        while self.now() < self.reference + end and not self.fell:
            self.step()

    def finish(self, fault: Fault) -> Verdict:
        """Run to the end with a fault, and return what the simulation's truth says."""
        self.fault = fault
        while (self.execution.running and not self.killed) or (
                self.now() <= self.moves_until):
            if self.fell or self.now() >= self.reference + LONGEST:
                break
            self.step()
        self.run_until(min(self.now() - self.reference + AFTERWARDS[self.motion], LONGEST))
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
