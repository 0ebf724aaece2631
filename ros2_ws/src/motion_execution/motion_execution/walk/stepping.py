"""Sends a motion over footsteps to the driver, step by step.

Each trajectory ends with the robot standing on two feet (`sections`); shortly before each step the
trajectory with this step replaces the one that would stand before it. A stop is therefore no
command: the next step is not sent.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from door_impact_common.arrays import Array
from humanoid_motion.driver_interface import Command
from humanoid_motion.knots import Knots
from humanoid_motion.robot_model import RobotModel
from robot_driver.motion import Motion, Outcome
from walking.errors import PLANNING_ERRORS
from walking.footsteps.footstep import Stance
from walking.pattern.sections import Rest, rest_after, section
from walking.pattern.settings import WalkSettings
from walking.pattern.state import WalkState
from walking.pattern.timing import Phase
from walking.pattern.walk_plan import WalkPlan

from motion_execution.judge import fell, off_track
from motion_execution.settings import ExecutionSettings

STANDS = "the driver finishes the trajectory that it has, which ends with the robot standing"


@dataclass(frozen=True)
class Sent:
    """What the driver has of a plan.

    Attributes:
        plan: The plan.
        rest: How the robot comes to rest after the footsteps that were sent.
        knots: Trajectory that was sent last; its times count from the beginning of the plan.
        steps: Number of footsteps of the plan that were sent.
        origin: Time of the robot's clock at which the plan begins [s]; NaN before the start.
        made: Number of footsteps of earlier plans that were made.
        before: Phase at the end of the earlier plan; None after a rest.
    """

    plan: WalkPlan
    rest: Rest
    knots: Knots
    steps: int = 0
    origin: float = math.nan
    made: int = 0
    before: Phase | None = None

    @property
    def command(self) -> Command:
        """The command that was sent last."""
        return Command(self.origin, self.knots)

    @property
    def boundary(self) -> float:
        """Time of the robot's clock at which the first step that was not sent begins [s]."""
        return self.origin + self.plan.begin_of(self.steps)

    @property
    def complete(self) -> bool:
        """Whether all footsteps of the plan were sent."""
        return self.steps == len(self.plan.footsteps)

    def position(self, now: float) -> Array:
        """Return the joint positions at a time of the robot's clock [s], (J,) [rad]."""
        return self.knots.at(now - self.origin)[0][0]

    def landed(self, now: float) -> int:
        """Return the number of footsteps that have touched the floor at a time [s]."""
        return self.made + sum(
            now >= self.origin + self.plan.begin_of(step + 1) for step in range(self.steps))

    def phase(self, now: float) -> Phase:
        """Return the phase at a time of the robot's clock [s]."""
        if now < self.origin and self.before is not None:
            return self.before
        return self.rest.phase if now >= self.boundary else self.plan.phase_at(now - self.origin)


class Stepping(Motion):
    """A motion over footsteps.

    Args:
        plan: The motion, from rest.
        pattern: Settings with which it was planned.
        settings: Thresholds.
        free: Columns of joints that the driver may move away from the plan, such as those of an
            arm whose hand yields.

    Attributes:
        recovered: How often a push has changed the steps.

    Raises:
        DoorImpactError: The motion cannot begin: the robot could not come to rest before it.
    """

    recovered = 0

    def __init__(
        self, robot: RobotModel, plan: WalkPlan, pattern: WalkSettings,
        settings: ExecutionSettings, free: Sequence[int] = (),
    ) -> None:
        self._robot, self._pattern, self._settings = robot, pattern, settings
        self._free = list(free)
        self._sent = self._unsent(plan)
        self._had: Sent | None = None  # before the last step, until this is judged
        self._next_rest: Rest | None = None  # after the next step
        self._stopping: tuple[Outcome, str] | None = None  # how the motion ends at rest
        self._tilt = 0.0  # of the trunk, at its last measurement [rad]

    def _unsent(self, plan: WalkPlan) -> Sent:
        """Return what is to be sent before the first step of a plan."""
        rest = rest_after(self._robot, plan, 0, self._pattern)
        return Sent(plan, rest, section(plan, 0, rest))

    # -- what is going on ------------------------------------------------------------------------

    @property
    def plan(self) -> WalkPlan:
        """The present plan."""
        return self._sent.plan

    @property
    def steps(self) -> int:
        """Number of footsteps, with those of earlier plans that were made."""
        return self._sent.made + len(self.plan.footsteps)

    @property
    def steps_sent(self) -> int:
        """Number of footsteps that were sent to the driver, whether it has made them or not."""
        return self._sent.made + self._sent.steps

    @property
    def final(self) -> WalkState:
        """State at rest after the trajectory that was sent last, as planned."""
        return self._sent.rest.final

    @property
    def stance(self) -> Stance:
        """The soles after the trajectory that was sent last, as planned."""
        return self.final.stance

    def since(self, now: float) -> float:
        """Return the time since the present plan began, at a time of the robot's clock [s]."""
        return now - self._sent.origin

    def steps_made(self, now: float) -> int:
        """Return the number of footsteps that have touched the floor at a time [s]."""
        return self._sent.landed(now)

    def phase(self, now: float) -> Phase:
        """Return the phase at a time of the robot's clock [s], of the trajectory that was sent."""
        return self._sent.phase(now)

    def resting(self, now: float) -> bool:
        """Whether the robot stands at the end of the trajectory that was sent last."""
        return bool(self.since(now) >= self._sent.knots.time[-1] + self._settings.settle)

    # -- requests --------------------------------------------------------------------------------

    def start(self, now: float) -> Command:
        """Start, and return the trajectory up to the begin of the first step.

        Args:
            now: Time of the robot's clock [s].
        """
        lead, knots = self._settings.lead, self._sent.knots
        self._sent = replace(self._sent, origin=now + lead)
        # Stamped now, the driver goes from its reference to the first posture meanwhile.
        return Command(now, replace(knots, time=knots.time + lead))

    def stop(self, why: str = "") -> None:
        """Make no further step: the one whose motion was sent is finished, and the robot stands."""
        self._end_at_rest(Outcome.STOPPED, why or "the motion was stopped, as requested")

    def give_up(self, why: str) -> None:
        """End without a command: the driver finishes what it has, and the robot stands."""
        super().give_up(f"{why}; {STANDS}")

    def prepare_next(self) -> None:
        """Plan how the robot comes to rest after the next step, while there is time for it."""
        sent = self._sent
        if self.running and self._next_rest is None and not sent.complete:
            try:
                self._next_rest = rest_after(self._robot, sent.plan, sent.steps + 1, self._pattern)
            except PLANNING_ERRORS:
                return  # `_send_next` says so

    # -- events ----------------------------------------------------------------------------------

    def on_joints(self, now: float, position: Array, velocity: Array) -> list[Command]:
        """Judge the joints, and send the next step when its time has come."""
        if not self.running:
            return []
        self._judge_last(now, position)
        why = self._off_track(now, position)
        if why:
            return self._ended(Outcome.NOT_FOLLOWED, f"{why}; {STANDS}")
        present = now + self.lag
        return self._at_rest(present) if self.resting(now) else self._under_way(present)

    def on_imu(self, now: float, tilt: float, force: Array) -> list[Command]:
        """Stop the driver when the robot falls."""
        self._tilt = tilt
        why = fell(self._tilt, self._settings.fall_tilt)
        if not why or not self.running:
            return []
        return [*self._ended(Outcome.FELL, why), Command(0.0, None)]

    # -- what a motion adds to ---------------------------------------------------------------------

    def _under_way(self, present: float) -> list[Command]:
        """Return the command with the next step once the clock [s] is close to its begin."""
        sent, settings = self._sent, self._settings
        if self._stopping or sent.complete or present < sent.boundary - settings.commit:
            return []
        if present + settings.splice > sent.boundary + settings.latest:
            return []  # too late for this step: the robot comes to rest before it
        return self._send_next(present)

    def _at_rest(self, present: float) -> list[Command]:
        """End when the robot has come to rest, at the present time of the robot's clock [s]."""
        if self._stopping:
            return self._ended(*self._stopping)
        if self._sent.complete:
            return self._ended(Outcome.SUCCESS)
        return self._ended(Outcome.STOPPED, "the robot came to rest before its last step because "
                           "messages were late or the computer was busy")

    # -- steps -------------------------------------------------------------------------------------

    def _send_next(self, present: float) -> list[Command]:
        """Send the next step, if the robot could come to rest after it."""
        sent = self._sent
        step = sent.steps + 1
        try:
            rest = self._next_rest or rest_after(self._robot, sent.plan, step, self._pattern)
        except PLANNING_ERRORS as error:
            self.stop(f"the robot could not come to rest after the footstep {step}: {error}")
            return []
        knots = section(sent.plan, step, rest, present - sent.origin)
        self._had, self._next_rest = sent, None
        self._sent = replace(sent, rest=rest, knots=knots, steps=step)
        return [self._sent.command]

    def _judge_last(self, now: float, position: Array) -> None:
        """Count the last step as not sent if its motion came too late for the driver.

        The driver then follows what it had, which ends at rest before the step. As soon as the two
        motions are far enough apart, the joints show which one it follows.
        """
        if self._had is None or now < self._had.boundary:
            return
        had = self._had.position(now)
        way = self._sent.position(now) - had
        way[self._free] = 0.0
        if way @ way < self._settings.apart**2:
            return
        if (position - had) @ way < self._settings.missed * (way @ way):
            self._sent = self._had
        self._had = None

    def _off_track(self, now: float, position: Array) -> str:
        """Reason for a robot that does not follow its trajectory; empty where it does."""
        if now < self._sent.origin or self._tilt > self._settings.leaning:
            return ""
        wanted = self._sent.position(now)
        wanted[self._free] = position[self._free]
        return off_track(position, wanted, self._robot.joint_names, self._settings.walk_tracking,
                         "its trajectory is")

    def _end_at_rest(self, outcome: Outcome, why: str) -> None:
        """Make no further step, and end so when the robot stands; the first reason counts."""
        self._stopping = self._stopping or (outcome, why)

    def _ended(self, outcome: Outcome, reason: str = "") -> list[Command]:
        """End without a command: the driver finishes what it has."""
        self.outcome, self.reason = outcome, reason
        return []
