"""Runs a plan: what to send to the driver, and when, from what a robot can feel.

A state machine without ROS: it is told what the robot and the door feel and answers with
trajectories. Everything up to the end of the run-up goes out as one. The contact is felt by the
feet, else by the door's encoder, and the motion after the hit takes over a fixed time after its
begin, wherever the door stands. Without a contact the run-up comes to rest by itself. The arm goes
out, or the robot back, on the door's measured peak.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.knots import Knots
from humanoid_motion.splice import concatenate, duration, shifted, slowed, without_first

from impact_planner.errors import InvalidRequest
from impact_planner.execution.speed_of_b import SpeedOfB
from impact_planner.execution.types import (
    APPROACH,
    MISSED,
    SCALED,
    Command,
    ExecutablePlan,
    ExecutionSettings,
    Measured,
    Outcome,
    held_verdict,
    off_track,
    too_far_off,
)
from impact_planner.motion.post import continue_from, to_rest_within
from impact_planner.task.settings import ENDINGS


@dataclass
class Execution:
    """State of one run of a plan.

    Args:
        plan: The plan.
        speed_of_b: Speed of point B towards the door [m/s] from joint positions, joint speeds and
            the IMU's angular velocity, (30,), (30,) and (3,).
        settings: Thresholds.
        speed_scale: Slows down the phases before the run-up, 0 < speed_scale <= 1.
        joint_names: In the order of the knots' columns, for what is told about a joint.

    Attributes:
        outcome: RUNNING until the execution has ended.
        reason: A sentence on how it ended, where there is more to say than the outcome.
        phase: The one that it is in.
        measured: What it felt so far.
        door_angle: The last one heard [rad].
        turned_round: Whether the door was seen to open to its peak.

    Raises:
        InvalidRequest: A scale out of range.
    """

    plan: ExecutablePlan
    speed_of_b: Callable[[Array, Array, Array], float]
    settings: ExecutionSettings = field(default_factory=ExecutionSettings)
    speed_scale: float = 1.0
    joint_names: Sequence[str] = ()

    def __post_init__(self) -> None:
        """Checks the scale."""
        if not 0.0 < self.speed_scale <= 1.0:
            raise InvalidRequest(
                f"speed_scale {self.speed_scale} is not above 0 and at most 1",
                quantity="speed_scale", value=self.speed_scale, limit=(0.0, 1.0))
        self.outcome = Outcome.RUNNING
        self.reason = ""
        self.phase = APPROACH[0]
        self.measured = Measured()
        self.door_angle = 0.0
        self.turned_round = False
        self._starts: dict[str, float] = {}
        self._end = np.inf
        self._sent: tuple[float, Knots] | None = None
        self._speed = SpeedOfB(self.speed_of_b)
        self._held: deque[float] = deque(maxlen=30)
        self._stop_asked = False
        self._went_back = ""  # why, in place of the plan's ending
        self._door_heard = -np.inf
        self._heard = -np.inf
        self._at_rest = np.inf  # after a stop in the run-up

    def start(self, now: float) -> Command:
        """Everything up to the end of the run-up, as one trajectory.

        Args:
            now: The robot's clock [s].
        """
        stamp = at = now + self.settings.lead
        parts = []
        for name in APPROACH:
            knots = self.plan.phases[name]
            if name in SCALED:
                knots = slowed(knots, self.speed_scale)
            self._starts[name] = at
            at += duration(knots)
            parts.append(knots)
        self._end = at
        whole = concatenate(parts)
        self._sent = (stamp, whole)
        return Command(stamp, whole)

    @property
    def starts(self) -> dict[str, float]:
        """When the phases began or will begin, on the robot's clock [s]."""
        return dict(self._starts)

    @property
    def planned_contact(self) -> float:
        """When the contact is planned, on the robot's clock [s]."""
        return self._starts["cam"] + self.plan.contact_time

    def on_joint_state(self, now: float, position: Array, velocity: Array) -> list[Command]:
        """Takes a joint state and answers with what to send.

        Args:
            now: Stamp of the joint state [s].
            position: (30,) [rad].
            velocity: (30,) [rad/s].
        """
        self._heard = now
        if self.outcome is not Outcome.RUNNING:
            return []
        if self._stopping:
            return self._come_to_rest(now, position)
        if self.phase in APPROACH:  # what follows begins with contact and peak, not by the clock
            for name, start in self._starts.items():
                if now >= start:
                    self.phase = name
        if self._stop_asked and not self.past_no_return(now):
            if self.phase == "cam":
                return self._brake(now)
            return self._stop(Outcome.STOPPED, f"stopped in the phase {self.phase}, as asked")
        if self.phase in ENDINGS:
            return self._judge_ending(position) if now >= self._end else []
        if self.phase == "post" and now > self._starts["post"] + self._longest_opening:
            return self._go_back(now, "the door was not seen to turn round within "
                                 f"{self._longest_opening:.1f} s after the hit")
        self._speed.joints = (now, position, velocity)
        self._watch_b()
        if self.phase == "cam" and now > self._end + self.settings.late:
            return self._ended(Outcome.NO_CONTACT, MISSED)
        return self._watch_tracking(now, position)

    def _ended(self, outcome: Outcome, reason: str) -> list[Command]:
        """Ends without a word to the driver."""
        self.outcome, self.reason = outcome, reason
        return []

    @property
    def _longest_opening(self) -> float:
        """In which the door must be seen to turn round [s]."""
        return self.settings.slower * duration(self.plan.phases["post"])

    def _judge_ending(self, position: Array) -> list[Command]:
        """Ends with success; a hold only where the door stands still near the desired angle."""
        assert self._sent is not None
        why = off_track(position, self._sent[1].position[-1], self.joint_names,
                        self.settings.tracking, f"the {self.phase} ends")
        if why:
            return self._ended(Outcome.NOT_FOLLOWED, why)
        if self._went_back:
            return self._ended(Outcome.NOT_HELD, f"{self._went_back}; the robot went back")
        if self.phase != self.plan.ending:
            return self._ended(Outcome.STOPPED, "stopped after the hit, back from the door")
        if self.phase != "hold":
            return self._ended(Outcome.SUCCESS, "the door was opened, the robot went back")
        self.measured.held_angle = float(np.mean(self._held))
        return self._ended(*held_verdict(
            self._held, self.plan.desired_angle, self.settings.held_within))

    def _watch_tracking(self, now: float, position: Array) -> list[Command]:
        """Stops where the joints are not where they were sent, while a stop keeps balance."""
        if self._sent is None or self.past_no_return(now):
            return []
        stamp, knots = self._sent
        why = off_track(position, knots.at(now - stamp)[0][0], self.joint_names,
                        self.settings.tracking, "it was sent")
        why = why and f"stopped in the phase {self.phase}: {why}"
        return self._stop(Outcome.NOT_FOLLOWED, why) if why else []

    def _watch_b(self) -> None:
        """Speeds of B around the hit."""
        told = self._speed.now() if self.phase in ("cam", "post") else None
        if told is None:
            return
        now, speed = told
        measured, felt = self.measured, not np.isnan(self.measured.contact_time)
        if not felt and now <= self.planned_contact + self.plan.steady_time:
            measured.v_rb = self._speed.before_contact(speed)
        elif felt and np.isnan(measured.v_rb_post) and (
                now >= measured.contact_time + self.settings.settle):
            measured.v_rb_post = speed

    # -- contact ------------------------------------------------------------------------------

    def on_foot_forces(self, now: float, force: float) -> list[Command]:
        """Takes what the floor does to the feet and answers with what to send.

        Args:
            now: Stamp of the wrenches [s].
            force: Of the floor on both feet towards the door [N]. The leaf that pushes the robot
                back makes the legs, which keep their speed, push the floor away from the door.
        """
        if self.outcome is not Outcome.RUNNING or self.phase != "cam" or self._stopping:
            return []
        begin = now - self.settings.felt_after
        # Only while the speed is constant: else the floor's force is the run-up's own.
        steady = self.plan.steady_time + self.settings.splice
        if abs(begin - self.planned_contact) <= steady and force >= self.settings.felt_force:
            return self._contact(begin)
        return []

    def on_door(self, now: float, angle: float, velocity: float) -> list[Command]:
        """Takes an angle of the door and answers with what to send.

        Args:
            now: Stamp of the angle [s].
            angle: [rad].
            velocity: [rad/s].
        """
        stale = abs(now - self._heard) > self.settings.stale
        if now <= self._door_heard or stale or not np.isfinite([angle, velocity]).all():
            return []
        self._door_heard = now
        self.door_angle = angle
        self._held.append(angle)
        running = self.outcome is Outcome.RUNNING and not self._stopping
        if not running or self.phase not in ("cam", "post"):
            return []
        if not np.isnan(self.measured.contact_time):
            return self._follow_opening(now, angle, velocity)
        return self._contact(now) if velocity > self.settings.door_moves else []

    def _contact(self, begin: float) -> list[Command]:
        """The contact has begun: the switch to the motion after the hit.

        Args:
            begin: When, by the robot's clock [s].
        """
        plan, cam = self.plan, self.plan.phases["cam"]
        self.phase = "post"
        # What tells of it may be so late that the switch must be later, too.
        stamp = max(begin + plan.switch_delay, self._heard + self.settings.splice)
        path_time = float(np.clip(stamp - self._starts["cam"], 0.0, cam.time[-1]))
        knots = to_rest_within(
            cam, path_time, plan.post_ratio, plan.rest_duration, plan.slow_down)
        self.measured.contact_time = begin
        self.measured.contact_delay = begin - self.planned_contact
        self.measured.switch_latency = stamp - begin
        self._starts["post"] = stamp
        self._end = stamp + duration(knots)
        self._sent = (stamp, knots)
        return [Command(stamp, knots)]

    def _follow_opening(self, now: float, angle: float, velocity: float) -> list[Command]:
        """Waits for the door's peak; then the arm goes out, or the robot back."""
        measured = self.measured
        measured.omega_door = float(np.fmax(measured.omega_door, velocity))
        if not measured.peak_angle >= angle:
            measured.peak_angle, measured.peak_time = angle, now - measured.contact_time
        if measured.peak_angle - angle < self.settings.peak_drop:
            return []
        self.turned_round = True
        off = measured.peak_angle - self.plan.desired_angle
        if self.plan.ending == "hold" and abs(off) > self.settings.hold_within:
            return self._go_back(now, too_far_off(measured.peak_angle, self.plan.desired_angle))
        self.phase = self.plan.ending
        if self._stop_asked and "retreat" not in self.plan.phases:
            return self._stop(Outcome.STOPPED, "stopped after the hit, as asked")
        if self._stop_asked:
            self.phase, self._stop_asked = "retreat", False  # a second stop is one in the retreat
        return self._end_with(now)

    def _go_back(self, now: float, why: str) -> list[Command]:
        """Retreats where the plan's ending makes no sense; stops where it has no retreat."""
        if "retreat" not in self.plan.phases:
            return self._stop(Outcome.NOT_HELD, why)
        self.phase, self._stop_asked, self._went_back = "retreat", False, why
        return self._end_with(now)

    def _end_with(self, now: float) -> list[Command]:
        """The phase that follows the door's peak."""
        # Without the first knot: the driver starts from where it is.
        ending = self._shifted(without_first(self.plan.phases[self.phase]))
        self._sent = (now, ending)
        self._starts[self.phase] = now
        self._end = now + self.settings.judged_after + float(ending.time[-1])
        return [Command(0.0, ending)]  # from its arrival on: late is better than refused

    def _shifted(self, ending: Knots) -> Knots:
        """What follows the peak of a door that stood elsewhere: off by as much as after the hit.

        So the arm finds the leaf as planned, from a body that stands to it as planned. The retreat
        goes far from there: it comes back to the plan.
        """
        assert self._sent is not None
        off = self._sent[1].position[-1] - self.plan.phases["post"].position[-1]
        # A door that stood still farther off would take joints to the ends of their ranges.
        off *= min(1.0, self.plan.steady_time / max(abs(self.measured.contact_delay), 1e-9))
        return shifted(
            ending, off, np.inf if self.phase == "hold" else self.settings.back_to_plan)

    # -- stop ---------------------------------------------------------------------------------

    def past_no_return(self, now: float) -> bool:
        """Whether a stop would lose balance, so that the hit must be completed.

        From shortly before the hit until the door's peak; what follows can be stopped again.
        """
        if self._stopping or self.phase in ENDINGS or now < self._starts.get("cam", np.inf):
            return False
        return now > self.planned_contact - self.plan.point_of_no_return

    def stop(self) -> None:
        """Asks for a stop: at the next joint state; past no return, for a retreat after the hit."""
        self._stop_asked = True

    def on_silence(self, now: float, topic: str, seconds: float) -> list[Command]:
        """Ends where nothing is heard any more; the driver is stopped if that keeps balance.

        Args:
            now: The robot's clock [s].
            topic: What has fallen silent.
            seconds: For how long [s].
        """
        if self.outcome is not Outcome.RUNNING:
            return []
        silence = f"{topic} has been silent for {seconds:.2f} s in the phase {self.phase}"
        if not self.past_no_return(now):
            return self._stop(Outcome.STOPPED, f"stopped: {silence}")
        self.give_up(f"given up, the driver finishes what it was sent: {silence}")
        return []

    @property
    def _stopping(self) -> bool:
        """Whether the run-up is being slowed down to rest."""
        return self._at_rest < np.inf

    def _brake(self, now: float) -> list[Command]:
        """Slows the run-up down as the plan says: the driver's own stop is too hard for it."""
        self._stop_asked = False
        stamp = now + self.settings.splice
        knots = continue_from(
            self.plan.phases["cam"], stamp - self._starts["cam"], 1.0, self.plan.stop_duration)
        self._sent = (stamp, knots)
        self._at_rest = stamp + duration(knots) + self.settings.settle
        return [Command(stamp, knots)]

    def _come_to_rest(self, now: float, position: Array) -> list[Command]:
        """The end of a stop in the run-up."""
        if now < self._at_rest:
            return self._watch_tracking(now, position)
        return self._ended(Outcome.STOPPED, f"stopped in the phase {self.phase}, as asked")

    def give_up(self, reason: str) -> None:
        """Ends without a word to the driver."""
        if self.outcome is Outcome.RUNNING:
            self.outcome, self.reason = Outcome.STOPPED, reason

    def _stop(self, outcome: Outcome, reason: str = "") -> list[Command]:
        """Ends, and tells the driver to stop."""
        self.outcome, self.reason = outcome, reason
        return [Command(0.0, None)]

    def on_imu(self, now: float, tilt: float, rate: Array) -> list[Command]:
        """Takes a reading of the IMU and stops where the robot falls.

        Args:
            now: Its stamp [s].
            tilt: Of the trunk [rad].
            rate: Angular velocity in the IMU's frame, (3,) [rad/s].
        """
        self._speed.rate = (now, rate)
        self._watch_b()
        if self.outcome is Outcome.RUNNING and tilt > self.settings.fall_tilt:
            return self._stop(Outcome.FELL)
        return []

    def progress(self, now: float) -> float:
        """Share of the phase that has passed, 0 to 1."""
        start = self._starts.get(self.phase, now)
        later = [time for time in self._starts.values() if time > start]
        end = min(later, default=self._end)
        return float(np.clip((now - start) / max(end - start, 1e-9), 0.0, 1.0))
