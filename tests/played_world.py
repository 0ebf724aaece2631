"""A mission's world in which the robot follows exactly, and hits and walks take no time."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from door_impact_evaluation.run.driver_link import at_once
from door_model.door.config import load_door
from humanoid_motion.driver_interface import Command
from humanoid_motion.kinematics import yaw_of
from humanoid_motion.samples import ImuSample
from impact_planner.impact_plan import ImpactPlan
from impact_planner.task.known_door import KnownDoor
from motion_execution.hit.types import Measured
from motion_execution.mission.hit_plan import HitPlan
from motion_execution.mission.mission import PASSAGE, Mission
from motion_execution.mission.order import Order
from motion_execution.mission.passing import Passed
from motion_execution.mission.routine import until
from motion_execution.mission.ways import Wanted
from motion_execution.walk.passage import Passage
from motion_execution.walk.reaching import Reaching
from robot_driver.inputs import Inputs
from robot_driver.intake import Arrival
from robot_driver.motion import Motion, Outcome
from walking.footsteps.footstep import ORIGIN, Pose
from walking.passing.settings import PassageSettings

TICK = 0.005  # period of the driver [s]
SURVEY = Pose(-0.4056, -0.715, 0.0)
OFF = Pose(0.012, -0.006, math.radians(0.6))  # of a walk's end from its goal
UPRIGHT = ImuSample(np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(3), np.array([0.0, 0.0, 9.81]))


class Ended(Motion):
    """A motion that has ended."""

    def __init__(self, outcome: Outcome, **measured: Any) -> None:
        self.outcome, self.reason, self.phase = outcome, outcome.value, "hold"
        self.measured = Measured(**measured)
        self.turned_round = True


class World:
    """Robot, leaf, planner and user; it is the mission's link, and plays its hits and walks.

    Attributes:
        requests: What the planner was asked for.
        hits: Probes and speeds of the hits.
        walks: Goals of the walks.
        feedback: Progress that was told.
    """

    yields = True

    def __init__(self, robot: Any, task: Any, plan: ImpactPlan, door: str = "paper") -> None:
        self.robot, self.task, self.plan = robot, task, plan
        self.inputs = Inputs(robot)
        self.position, self.angle, self.time = robot.config.half_sitting, 0.0, 1.0
        self.followed: Command | None = None
        self.stance, self.place = task.stance, ORIGIN  # soles seen from the place, in odom
        self.requests, self.hits, self.walks = [], [], []
        self.feedback, self.compliance, self.said = [], [], []
        self.told: Pose | None = None
        self.door, self.last_hit = KnownDoor.configured(load_door(door)), None
        self.off: Callable[[float], float] = lambda _: 0.0  # of the leaf from its plan [rad]
        self.touches = 3.3  # time since its begin at which a reach meets the leaf [s]
        self.hold = None  # a hit or a walk lasts until this is true
        self.walk_ends = Outcome.SUCCESS
        self.mission = Mission(robot, self, SURVEY, PassageSettings.of(robot, hand_stiffness=400.0))
        for played in (self.mission._hits, self.mission._passing._hits):
            played.make, played.margin = self.hit, lambda execution: 0.03
        self.mission._passing._walks.go = self.walk
        self.mission._passing._walks.plan = self.plan_walk

    # -- the link -------------------------------------------------------------------------------

    def now(self):
        return self.time

    clock = now

    def listen(self, *, on):
        self.inputs.forget()

    def refusal(self, topics):
        return None

    def base(self):
        sole, = self.robot.poses_in_base(self.position, [self.robot.feet["left"].frame])
        foot = Pose(float(sole[0, 3]), float(sole[1, 3]), yaw_of(sole))
        return self.time, self.place.moved(*self.stance.left).moved(*ORIGIN.seen_from(foot))

    def zmp(self):
        return None

    def door_pose(self, along):
        return self.told

    def send(self, command):
        self.followed = command

    def comply(self, *impedance):
        self.compliance.append(impedance)

    def plan_hit(self, request):
        self.requests.append(request)
        return at_once(self.hit_plan, request)

    def compute(self, work, *args):
        return at_once(work, self.robot, *args)

    def show(self, footsteps):
        pass

    def say(self, text, *, warning=False):
        self.said.append(text)

    # -- what is played -------------------------------------------------------------------------

    def hit_plan(self, request):
        """A plan whose hit ends where the passage begins."""
        plan, task = self.plan, self.task
        made = HitPlan.of(plan, {each.name: each.knots for each in plan.all_phases}, {},
                          np.array(task.stance.left[:2]), np.array(task.stance.right[:2]),
                          np.zeros(2))
        hold = made.executable.phases["hold"]
        last = hold.position.copy()
        last[-1] = task.joints
        phases = made.executable.phases | {"hold": replace(hold, position=last)}
        x, y = task.doorway.hinge
        l_b = request.l_b if request.l_b > 0.0 else 0.4
        y = -request.door_distance if request.l_b > 0.0 else y
        return replace(
            made, executable=replace(made.executable, phases=phases, held_angle=task.angle),
            contact_point=np.array((x + 0.4, y)), l_b=l_b)

    async def hit(self, plan, order, *, probe="auto", speed_scale=1.0, dry_run=False):
        """Put the robot where the hit ends, without the motion that leads there."""
        self.hits.append((probe, speed_scale, dry_run))
        if dry_run:
            return None
        if self.hold is not None:
            await until(lambda: self.hold() or order.stopped)
        if order.stopped:
            return Ended(Outcome.STOPPED)
        self.position, self.angle, self.followed = self.task.joints, self.task.angle, None
        return Ended(Outcome.SUCCESS, contact_sensor="feet", contact_time=self.time,
                     peak_angle=0.44)

    async def plan_walk(self, goal, order):
        self.walks.append(goal.pose)

    async def walk(self, goal, order):
        """Put the robot near the goal."""
        self.walks.append(goal.pose)
        if self.hold is not None:
            await until(lambda: self.hold() or order.stopped)
        if self.walk_ends is Outcome.SUCCESS and not order.stopped:
            self.place = goal.pose.moved(*OFF)
        return Ended(Outcome.STOPPED if order.stopped else self.walk_ends)

    # -- the user -------------------------------------------------------------------------------

    def begin(self, **wanted):
        """Order a passage; return its routine, its order and what becomes of it."""
        order, passed = Order(PASSAGE, self.feedback.append), Passed()
        return self.mission.run(self.mission.pass_door(Wanted(**wanted), order, passed)), order, \
            passed

    def go(self, **wanted):
        """Go through the door; return what has become of it."""
        routine, _, passed = self.begin(**wanted)
        self.until(lambda: routine.done)
        routine.result()
        return passed

    def until(self, done):
        """Let the robot move until a condition holds."""
        for _ in range(20000):
            if done():
                return
            self.tick()
        raise AssertionError("nothing happened")

    def phase(self, name):
        """Wait for a phase."""
        self.until(lambda: self.feedback and self.feedback[-1].phase == name)

    @property
    def phases(self):
        """The phases in their order."""
        return list(dict.fromkeys(each.phase for each in self.feedback))

    def tick(self):
        """What the robot measures, as it follows its trajectory."""
        self.time += TICK
        if self.followed is not None and self.followed.knots is not None:
            since, knots = self.time - self.followed.stamp, self.followed.knots
            self.position = knots.at(min(max(since, 0.0), knots.time[-1]))[0][0]
        motion, force = self.mission.body.motion, 0.0
        if isinstance(motion, Reaching):
            force = 12.0 * (motion.since(self.time) > self.touches)
        elif isinstance(motion, Passage):
            force = 12.0
            since = max(motion.since(self.time), 0.0)
            self.angle = float(motion.passage.push.at(np.array([since]))[0]) + self.off(since)
        at, inputs = Arrival(self.time, self.time, 0.0), self.inputs
        wrench = np.array([0.0, force, 0.0, 0.0, 0.0, 0.0])
        for heard in (lambda: inputs.on_joints(at, self.position, np.zeros(len(self.position))),
                      lambda: inputs.on_imu(at, UPRIGHT),
                      lambda: inputs.on_wrench("left", at, wrench),
                      lambda: inputs.on_wrench("right", at, wrench),
                      lambda: inputs.on_hand(at, wrench),
                      lambda: inputs.on_door(at, self.angle, 0.0)):
            self.mission.after(self.time, heard())
