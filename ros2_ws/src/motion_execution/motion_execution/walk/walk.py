"""The execution of a walk, without ROS.

The caller passes on the measurements, and sends the returned trajectories to the driver. Each
trajectory ends with the robot standing on two feet (`sections`); shortly before each step the
trajectory with this step replaces the one that would stand before it. A stop is therefore no
command: the next step is not sent.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.errors import DoorImpactError
from humanoid_motion.driver_interface import Command
from humanoid_motion.knots import Knots
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.samples import ImuSample, Measured
from robot_driver.motion import Motion, Outcome
from walking.errors import PLANNING_ERRORS
from walking.footsteps.footstep import Stance
from walking.pattern.plan import plan_walk
from walking.pattern.sections import Rest, rest_after, section
from walking.pattern.settings import WalkSettings
from walking.pattern.state import WalkState
from walking.pattern.timing import Phase
from walking.pattern.walk_plan import WalkPlan
from walking.recovery.estimate import Balance, com_over_sole, watch
from walking.recovery.recovery import Recovery, recover

from motion_execution.walk.settings import ExecutionSettings

STOPPED = "the motion was stopped, as requested; the robot stands"
STANDS = "the driver finishes the trajectory that it has, which ends with the robot standing"


class Walk(Motion):
    """One walk over footsteps, which newer footsteps may replace while it runs.

    Times are stamps of messages or times of the robot's clock, both in seconds.

    Args:
        plan: The walk, from rest.
        pattern: Settings with which it was planned.
        settings: Thresholds.
        onward: Function that plans how the walk goes on after a push has changed its steps and the
            robot stands again; None ends the walk there.
        free: Columns of joints that the driver may move away from the walk, such as those of an
            arm whose hand yields.

    Attributes:
        plan: The present plan.
        recovered: How often a push has changed the steps.

    Raises:
        DoorImpactError: The walk cannot begin: the robot could not come to rest before it.
    """

    def __init__(
        self, robot: RobotModel, plan: WalkPlan, pattern: WalkSettings | None = None,
        settings: ExecutionSettings | None = None,
        onward: Callable[[], WalkPlan] | None = None, free: Sequence[int] = (),
    ) -> None:
        self._robot, self._free = robot, list(free)
        self._pattern = pattern or WalkSettings()
        self._settings = settings or ExecutionSettings()
        self.recovered = 0
        self._tilt = 0.0  # of the trunk, at its last measurement [rad]
        self._onward = onward
        self._stopping = ""  # why no further step is to be made
        self._made = 0  # footsteps of earlier plans that were made
        self._held_plan = plan
        self._held = math.inf  # boundary beyond which no step is sent, while others are planned
        self._restarts = 0
        self._origin = math.nan  # time of the robot's clock at which the plan begins [s]
        self._begin(plan)

    def _begin(self, plan: WalkPlan) -> None:
        """Take a plan, of which no footstep is sent yet."""
        rest = rest_after(self._robot, plan, 0, self._pattern)
        self.plan, self._sent, self._rest = plan, 0, rest
        self._held = math.inf
        self._pending: tuple[int, WalkPlan] | None = None
        self._recovery: Recovery | None = None  # that made the present plan
        self._seen: Balance | None = None  # at the last sample
        self._next_rest: Rest | None = None
        self._before: Phase | None = None
        self._knots = section(plan, 0, rest)
        self._last: tuple[Knots, Rest] | None = None  # before the last step, until it is judged

    # -- what is going on ------------------------------------------------------------------------

    def since(self, now: float) -> float:
        """Return the time since the present plan began, at a time of the robot's clock [s]."""
        return now - self._origin

    @property
    def steps(self) -> int:
        """Number of footsteps of the walk, with those that were made before they were replaced."""
        if self._pending is None:
            return self._made + len(self.plan.footsteps)
        before, plan = self._pending
        return self._made + before + len(plan.footsteps)

    @property
    def steps_sent(self) -> int:
        """Number of footsteps whose motions the driver has, with those that it has made."""
        return self._made + self._sent

    def steps_made(self, now: float) -> int:
        """Return the number of footsteps that have touched the floor at a time [s]."""
        landed = sum(now >= self._origin + self.plan.begin_of(step + 1)
                    for step in range(self._sent))
        return self._made + landed

    @property
    def stance(self) -> Stance:
        """The soles after the trajectory that was sent last, as planned."""
        return self._rest.final.stance

    @property
    def final(self) -> WalkState:
        """State at rest after the trajectory that was sent last, as planned."""
        return self._rest.final

    def phase(self, now: float) -> Phase:
        """Return the phase at a time of the robot's clock [s], of the trajectory that was sent."""
        since = now - self._origin
        if since < 0.0 and self._before is not None:
            return self._before
        if since >= self.plan.begin_of(self._sent):
            return self._rest.phase
        return self.plan.phase_at(since)

    # -- requests --------------------------------------------------------------------------------

    def start(self, now: float) -> Command:
        """Start, and return the trajectory up to the begin of the first step.

        Args:
            now: Time of the robot's clock [s].
        """
        self._origin = now + self._settings.lead
        return Command(self._origin, self._knots)

    def stop(self, why: str = "") -> None:
        """Make no further step: the one whose motion was sent is finished, and the robot stands."""
        self._stopping = self._stopping or why or STOPPED

    def hold_for_new_footsteps(self, now: float) -> tuple[int, WalkState]:
        """Choose the boundary at which new footsteps begin, and make no step beyond it.

        Args:
            now: Time of the robot's clock [s].

        Returns:
            Number of footsteps of the present plan before the boundary, and the state there.
        """
        last = len(self.plan.footsteps)
        soon = now - self._origin + self._settings.planning + self._settings.commit
        step = self._sent
        while step < last and self.plan.begin_of(step) < soon:
            step += 1
        self._held, self._held_plan = step, self.plan
        return step, self.plan.boundaries[step]

    def go_on(self) -> None:
        """Go on with the present footsteps: no new ones could be planned."""
        self._held = math.inf

    def replace(self, step: int, plan: WalkPlan, now: float) -> bool:
        """Replace the footsteps beyond a boundary.

        Args:
            step: Number of footsteps before it, of `hold_for_new_footsteps`.
            plan: Walk from the state there.
            now: Time of the robot's clock [s].

        Returns:
            Whether it was in time; if not, the robot comes to rest at the boundary.
        """
        pushed = self.plan is not self._held_plan  # a push has changed the steps
        if self._stopping or pushed or self.outcome is not Outcome.RUNNING:
            return False
        boundary = self._origin + self.plan.begin_of(step)
        if self._sent > step or now + self._settings.splice > boundary + self._settings.latest:
            return False
        self._pending = (step, plan)
        return True

    def resting(self, now: float) -> bool:
        """Whether the robot stands at the end of the trajectory that was sent last."""
        return bool(now >= self._origin + self._knots.time[-1] + self._settings.settle)

    def resume(self, plan: WalkPlan, now: float) -> Command:
        """Walk on after a rest.

        Args:
            plan: Walk from the state `final`.
            now: Time of the robot's clock [s].

        Raises:
            DoorImpactError: The robot could not come to rest before the first step.
        """
        made = self._made + self._sent
        self._begin(plan)
        self._made = made
        return self.start(now)

    # -- events: each handler returns commands, which must be sent in their order -----------------

    def on_joints(self, now: float, position: Array, velocity: Array) -> list[Command]:
        """Handle joint positions [rad] and speeds [rad/s], (J,) each."""
        if self.outcome is not Outcome.RUNNING:
            return []
        self._judge_last(now, position)
        why = self._off_track(now, position)
        if why:
            return self._ended(Outcome.NOT_FOLLOWED, why)
        present = now + self.lag
        if self.resting(now):
            return self._at_rest(present)
        if self._pending is not None and self._sent == self._pending[0]:
            self._switch(*self._pending)
        if self._sent == len(self.plan.footsteps) or self._sent >= self._held or self._stopping:
            return []
        boundary = self._origin + self.plan.begin_of(self._sent)
        if present < boundary - self._settings.commit:
            return []
        if present + self._settings.splice > boundary + self._settings.latest:
            return []  # too late for this step: the robot comes to rest before it
        return self._send_next(present)

    def on_measured(self, now: float, measured: Measured) -> list[Command]:
        """Change the steps if a push has moved the capture point too far.

        Args:
            now: Stamp of the measurements, which belong together [s].
            measured: Joints, IMU and wrenches of the feet.
        """
        late = self.lag > 0.0  # a changed step that comes late makes the fall worse
        if self.outcome is not Outcome.RUNNING or now < self._origin or late or self.resting(now):
            return []
        since, boundary = now - self._origin, self.plan.begin_of(self._sent)
        plan, time, origin = self.plan, since, self._origin
        if since >= boundary:
            rest = self._rest
            plan, time = rest.plan, since - boundary + rest.begin
            origin = now - time
        self._seen = watch(self._robot, plan, time, measured, before=self._seen)
        if self._may_have_missed(now, self._seen):
            return []
        found = recover(
            self._robot, plan, time, measured, walk=self._pattern, previous=self._recovery,
            seen=self._seen)
        if found is None:
            return []
        self._made = self.steps_made(now)
        self.recovered += 1
        self.plan, self._recovery = found.plan, found
        self._sent = len(found.plan.footsteps)
        self._rest = rest_after(self._robot, found.plan, self._sent, self._pattern)
        self._knots, self._origin = found.plan.knots, origin + found.begin
        self._pending = self._next_rest = self._before = self._last = None
        return [Command(self._origin, self._knots)]

    def on_imu(self, now: float, reading: ImuSample) -> list[Command]:
        """Handle a reading of the IMU: stop the driver when the robot falls."""
        self._tilt = tilt = reading.tilt
        limit = self._settings.fall_tilt
        if self.outcome is not Outcome.RUNNING or tilt <= limit:
            return []
        return self._ended(
            Outcome.FELL, f"the robot fell: its trunk is tilted by {math.degrees(tilt):.1f} deg, "
            f"at most {math.degrees(limit):.1f} deg are allowed", stop_driver=True)

    def on_silence(self, now: float, topic: str, waited: float, limit: float) -> list[Command]:
        """Handle a topic without a message for a time [s] that exceeds its limit [s]."""
        self.give_up(f"no message has arrived on {topic} for {waited:.2f} s, at most {limit:g} s "
                     f"are allowed; {STANDS}")
        return []

    def on_failure(self, now: float, error: Exception) -> list[Command]:
        """Handle an error of the program: make no further step."""
        self.give_up(f"the walker failed: {type(error).__name__}: {error}; {STANDS}")
        return []

    def _switch(self, step: int, plan: WalkPlan) -> None:
        """Go over to new footsteps at a boundary up to which the motion has been sent."""
        begin = self.plan.begin_of(step)
        self._before = self.phase(self._origin + begin - 1e-6)
        self._knots = replace(self._knots, time=self._knots.time - begin)
        self._origin += begin
        self._made += step
        self.plan, self._sent, self._held = plan, 0, math.inf
        self._pending = self._next_rest = self._last = None

    def _send_next(self, present: float) -> list[Command]:
        """Send the next step, if the robot could come to rest after it."""
        step = self._sent + 1
        try:
            rest = self._next_rest or rest_after(self._robot, self.plan, step, self._pattern)
        except PLANNING_ERRORS as error:
            self.stop(f"the robot could not come to rest after the footstep {step}: {error}")
            return []
        self._last = self._knots, self._rest
        self._knots = section(self.plan, step, rest, present - self._origin)
        self._sent, self._rest, self._next_rest = step, rest, None
        return [Command(self._origin, self._knots)]

    def prepare_next(self) -> None:
        """Plan how the robot comes to rest after the next step, while there is time for it."""
        if self._next_rest is None and self.outcome is Outcome.RUNNING and (
                self._sent < min(len(self.plan.footsteps), self._held)):
            try:
                self._next_rest = rest_after(self._robot, self.plan, self._sent + 1, self._pattern)
            except PLANNING_ERRORS:
                return  # `_send_next` says so

    def _at_rest(self, present: float) -> list[Command]:
        """Judge a walk that has come to rest, or take it up again."""
        if self._stopping:
            return self._ended(Outcome.STOPPED, self._stopping)
        left = self.plan.footsteps[self._sent:]
        if not left and self._recovery is None:
            return self._ended(Outcome.SUCCESS, "")
        if not math.isinf(self._held):
            return []  # new footsteps are being planned
        if self._restarts == self._settings.restarts:
            return self._ended(
                Outcome.STOPPED, f"the walk came to rest {self._restarts + 1} times because "
                "messages were late, the computer was busy, or the robot was pushed")
        if self._recovery is not None and self._onward is None:
            return self._ended(Outcome.STOPPED, "a push has changed the steps; the robot stands")
        self._restarts += 1
        try:
            if self._recovery is not None and self._onward is not None:
                again = self._onward()
            else:
                again = plan_walk(self._robot, self._rest.final, left, self._pattern)
            return [self.resume(again, present)]
        except DoorImpactError as error:
            return self._ended(Outcome.STOPPED, f"the walk came to rest and cannot go on: {error}")

    def _judge_last(self, now: float, position: Array) -> None:
        """Count the last step as not sent if its motion came too late for the driver.

        The driver then follows what it had, which ends at rest before the step. As soon as the two
        motions are far enough apart, the joints show which one it follows.
        """
        if self._last is None or now < self._origin + self.plan.begin_of(self._sent - 1):
            return
        had, sent = (knots.at(now - self._origin)[0][0] for knots in (self._last[0], self._knots))
        way = sent - had
        way[self._free] = 0.0
        if way @ way < self._settings.apart**2:
            return
        if (position - had) @ way < self._settings.missed * (way @ way):
            self._knots, self._rest = self._last
            self._sent -= 1
        self._last = None

    def _may_have_missed(self, now: float, seen: Balance) -> bool:
        """Whether the robot's balance is rather that of a step whose motion came too late."""
        if self._last is None or seen.phase.kind != "single":
            return False
        position, velocity, _ = self._last[0].at(now - self._origin)
        side = seen.phase.sides[0]
        had = com_over_sole(self._robot, side, seen.phase.stance.foot(side), position[0],
                            velocity[0], None).capture_point
        to_last, to_sent = (np.linalg.norm(seen.capture_point - point)
                            for point in (had, seen.planned))
        return bool(to_last < to_sent)

    def _off_track(self, now: float, position: Array) -> str:
        """Reason for a robot that does not follow its trajectory; empty where it does."""
        if now < self._origin or self._tilt > self._settings.leaning:
            return ""
        off = np.abs(position - self._knots.at(now - self._origin)[0][0])
        off[self._free] = 0.0
        worst = int(np.argmax(off))
        if off[worst] <= self._settings.tracking:
            return ""
        return (f"{self._robot.joint_names[worst]} is {off[worst]:.3f} rad from where the walk is, "
                f"at most {self._settings.tracking:g} rad are allowed: the driver refused the "
                "trajectory or cannot follow it; what it has ends with the robot standing")

    def _ended(self, outcome: Outcome, reason: str, *, stop_driver: bool = False) -> list[Command]:
        self.outcome, self.reason = outcome, reason
        return [Command(0.0, None)] if stop_driver else []

