"""The states of an execution from the run-up on: which event each handles, and which follows.

::

    Waiting -> Approach -> RunUp -> AfterHit -> Hold or Retreat -> Ended
                             |
                             +----> Retreat (no contact, or noticed too late) -> Ended
                             |
                             +----> Stopping -> Ended

    event                 handled in
    joint state           every state before Ended
    specific force        RunUp: contact
    force on the feet     RunUp: contact
    angle of the door     RunUp: contact; AfterHit: peak
    tilt of the trunk     every state before Ended
    topic without a       every state before Ended
      message

`approach` has the states before the run-up, `probe` those of a probe between them, and `endings`
those after the door's peak.

Every trajectory that leads to the door ends in a retreat. The driver begins it by itself if no
command arrives in time, so that a door that falls shut never meets the robot. An event that is
handled too late (`Run.lag`) sends no command that depends on it.

A stop, a fall, a topic without a message and joints that do not follow their trajectory lead to
Ended. From the point of no return to the door's peak, however, a stop waits, the joints are not
compared with their trajectory, and a topic without a message does not stop the driver. A state is
never changed: each handler returns the state that follows, which may be the same state, and the
commands for the driver.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.driver_interface import Command
from humanoid_motion.knots import Knots
from humanoid_motion.splice import concatenate, duration, shifted, without_first
from impact_planner.motion.catch import LATE
from impact_planner.motion.post import back_along, continue_from, to_rest_within
from robot_driver.motion import Outcome

from motion_execution.hit import reasons
from motion_execution.hit.contact import Contact
from motion_execution.hit.endings import Hold, Retreat
from motion_execution.hit.run import Run
from motion_execution.hit.state import Following, Reaction, Reference
from motion_execution.hit.types import AFTER_HIT, RUN_UP


def there_and_back(path: Knots, rest: float, back: float) -> Knots:
    """Follow a path to its end, and go back along it.

    Args:
        rest: Time at its end [s].
        back: Duration of the way back [s].
    """
    return concatenate([path.held_until(float(path.time[-1]) + rest), back_along(path, back)])


@dataclass(frozen=True, kw_only=True)
class TowardsDoor(Following):
    """A state whose trajectory ends in a retreat."""

    def follow_back(self, begin: float, outcome: Outcome, why: str) -> Reaction:
        """Let the driver follow its trajectory to the end, which is the retreat; send nothing.

        Args:
            begin: Begin of the retreat on the robot's clock [s].
            outcome: Outcome of the execution after the retreat.
            why: Sentence that explains the outcome.
        """
        self.run.stop_requested = False  # a second request stops the retreat itself
        end = self.sent.end + self.run.settings.judged_after
        return Reaction(Retreat(run=self.run, phase="retreat", begin=begin, end=end, sent=self.sent,
                                outcome_at_end=outcome, reason_at_end=reasons.went_back(why)))


@dataclass(frozen=True, kw_only=True)
class RunUp(TowardsDoor):
    """The robot runs up; its trajectory goes on past the planned contact, to rest, and back."""

    def on_joint_state(self, now: float, position: Array, velocity: Array) -> Reaction:
        """Slow down if a stop is requested, go back if the contact was missed, check the joints."""
        run = self.run
        if run.stop_requested and not self.past_no_return(run.present(now)):
            return self._stop(run.present(now), reasons.stopped(self.phase))
        if now > self.end + run.settings.late:
            return self.follow_back(now, Outcome.NO_CONTACT, reasons.MISSED)
        return Reaction(self) if self.past_no_return(now) else self.compared(now, position)

    def on_specific_force(self, now: float, force: Array) -> Reaction:
        """Detect the contact by the accelerometer, while the planned speed is constant."""
        return self._expected(self.run.detector.on_imu(now, force))

    def on_foot_forces(self, now: float, force: float) -> Reaction:
        """Detect the contact by the force on the feet, while the planned speed is constant."""
        return self._expected(self.run.detector.on_feet(now, force))

    def on_door(self, now: float, angle: float, velocity: float) -> Reaction:
        """Detect a contact by the speed of the door if neither IMU nor feet showed it."""
        contact = self.run.detector.on_door(now, velocity)
        return Reaction(self) if contact is None else self._contact(contact)

    def _expected(self, contact: Contact | None) -> Reaction:
        """Switch to the motion after the hit if the planned speed is constant at the contact.

        At other times the run-up itself needs forces and accelerations, and a message that is
        wrong must not begin the motion after the hit.
        """
        if contact is None:
            return Reaction(self)
        run, splice = self.run, self.run.settings.splice
        steady, expected = run.steady + splice, run.planned_contact + run.later
        begin, shown = contact.begin - expected, contact.shown - expected
        # A little later the forces with which the run-up comes to rest begin.
        if abs(begin) > steady or shown > steady + splice:
            return Reaction(self)
        return self._contact(contact)

    def _contact(self, contact: Contact) -> Reaction:
        """Switch to the motion after the hit, unless the contact was noticed too late."""
        begin, now = contact.begin, contact.shown
        run, plan, cam = self.run, self.run.plan, self.run.plan.phases[RUN_UP]
        measured, present = run.measured, run.present(now)
        measured.contact_sensor = contact.sensor.value
        measured.contact_time = begin
        measured.contact_delay = begin - run.planned_contact
        if present - now > run.settings.late_event:
            return self.follow_back(now, Outcome.NOT_HELD, reasons.contact_too_late(
                present - now, run.settings.late_event))
        # The switch cannot begin before its command arrives, so a late detection delays it.
        stamp = max(begin + plan.switch_delay, present + run.settings.splice)
        path_time = float(np.clip(stamp - self.begin, 0.0, cam.time[-1]))
        knots = to_rest_within(
            cam, path_time, plan.post_ratio, plan.rest_duration, plan.slow_down)
        measured.switch_latency = stamp - begin
        state = AfterHit.of(run, stamp, knots)
        return Reaction(state, (Command(*state.sent),))

    def on_silence(self, now: float, why: str) -> Reaction:
        """Slow the run-up down while that is possible; later let the driver finish."""
        if self.past_no_return(now):
            return super().on_silence(now, why)
        return self._stop(now, f"the motion was stopped in the phase {self.phase}: {why}")

    def _stop(self, now: float, why: str) -> Reaction:
        """Slow the run-up down to rest by the plan's own stop.

        The driver's stop is so hard that the robot would lose its balance.

        Args:
            now: Present time on the robot's clock [s].
            why: Sentence that says why.
        """
        run, settings = self.run, self.run.settings
        run.stop_requested = False
        stamp = now + settings.splice
        knots = continue_from(
            run.plan.phases[RUN_UP], stamp - self.begin, 1.0, run.plan.stop_duration)
        state = Stopping(run=run, phase=self.phase, begin=self.begin, end=self.end,
                         sent=Reference(stamp, knots), reason_at_end=why,
                         at_rest=stamp + duration(knots) + settings.settle)
        return Reaction(state, (Command(stamp, knots),))


@dataclass(frozen=True, kw_only=True)
class Stopping(Following):
    """The run-up slows down to rest after a stop; a contact has no effect any more.

    Attributes:
        at_rest: Time at which the robot is at rest, on the robot's clock [s].
        reason_at_end: Sentence that says why the run-up was stopped.
    """

    at_rest: float
    reason_at_end: str

    def on_joint_state(self, now: float, position: Array, velocity: Array) -> Reaction:
        """Check the joints, and end when the robot is at rest."""
        if now < self.at_rest:
            return self.compared(now, position)
        return self.ended(Outcome.STOPPED, self.reason_at_end)

    def on_silence(self, now: float, why: str) -> Reaction:
        """End without a further command: the driver comes to rest by itself."""
        return self.ended(Outcome.STOPPED, self.reason_at_end)

    def past_no_return(self, now: float) -> bool:
        """Return False: in this state the robot keeps its balance in a stop."""
        return False


@dataclass(frozen=True, kw_only=True)
class AfterHit(TowardsDoor):
    """The robot comes to rest after the hit while the door opens to its peak.

    Attributes:
        rest: Joint positions at rest, (J,) [rad].
        goes_back_at: Time at which the driver begins the retreat by itself, on the robot's clock
            [s].
    """

    rest: Array
    goes_back_at: float

    @classmethod
    def of(cls, run: Run, stamp: float, knots: Knots) -> AfterHit:
        """Make the state, with the retreat that follows if no command arrives.

        Args:
            run: What all states of the execution share.
            stamp: Begin of the motion on the robot's clock [s].
            knots: The motion from the contact to rest.
        """
        rest, end = knots.position[-1], stamp + duration(knots)
        waits = duration(run.plan.phases[AFTER_HIT]) + run.settings.goes_back
        if "retreat" in run.plan.phases:
            retreat = _shifted(run, rest, "retreat", run.settings.back_to_plan)
            knots = concatenate([knots.held_until(waits), retreat])
        return cls(run=run, phase=AFTER_HIT, begin=stamp, end=end, sent=Reference(stamp, knots),
                   rest=rest, goes_back_at=stamp + waits)

    def on_joint_state(self, now: float, position: Array, velocity: Array) -> Reaction:
        """Stop if that is possible, go back if the peak does not come, check the joints.

        A hit far before its planned time leaves the robot where it can still be stopped.
        """
        run = self.run
        past_no_return = self.past_no_return(run.present(now))
        if run.stop_requested and not past_no_return:
            return self.stop_driver(Outcome.STOPPED, reasons.stopped(self.phase))
        if now >= self.goes_back_at:
            why = reasons.no_peak(self.goes_back_at - self.begin)
            if "retreat" not in run.plan.phases:
                return self.stop_driver(Outcome.NOT_HELD, why)
            return self.follow_back(self.goes_back_at, Outcome.NOT_HELD, why)
        return Reaction(self) if past_no_return else self.compared(now, position)

    def on_door(self, now: float, angle: float, velocity: float) -> Reaction:
        """Measure the opening; after the door's peak hold the door, retreat or stop."""
        run, plan, measured = self.run, self.run.plan, self.run.measured
        measured.omega_door = float(np.fmax(measured.omega_door, velocity))
        if not measured.peak_angle >= angle:
            measured.peak_angle, measured.peak_time = angle, now - measured.contact_time
        fell_back = measured.peak_angle - angle >= run.settings.peak_drop
        if not fell_back or run.present(now) >= self.goes_back_at:
            return Reaction(self)
        late = run.present(now) - measured.contact_time - measured.peak_time - LATE
        on_time = late <= run.settings.late_event
        run.turned_round = on_time  # otherwise the largest angle may have been missed
        limit = run.settings.hold_within
        if plan.ending == "hold" and abs(measured.peak_angle - plan.desired_angle) > limit:
            return self._go_back(
                now, reasons.too_far_off(measured.peak_angle, plan.desired_angle, limit))
        if run.stop_requested and "retreat" not in plan.phases:
            return replace(self, phase=plan.ending).stop_driver(
                Outcome.STOPPED, reasons.STOPPED_AFTER_HIT)
        if plan.ending == "hold" and not on_time:
            return self._go_back(now, reasons.peak_too_late(late, run.settings.late_event))
        if plan.ending == "retreat":
            return self._retreat(now, Outcome.SUCCESS, reasons.OPENED)
        if run.stop_requested:
            return self._retreat(now, Outcome.STOPPED, reasons.went_back(reasons.STOPPED_AFTER_HIT))
        return self._hold(now)

    def _go_back(self, now: float, why: str) -> Reaction:
        """Retreat because the door cannot be held; stop if the plan has no retreat.

        Args:
            now: Time of the robot's clock [s].
            why: Sentence that says why the door cannot be held.
        """
        if "retreat" not in self.run.plan.phases:
            return self.stop_driver(Outcome.NOT_HELD, why)
        return self._retreat(now, Outcome.NOT_HELD, reasons.went_back(why))

    def _hold(self, now: float) -> Reaction:
        """Catch the door with the hand."""
        # The arm must meet the leaf in time: the driver skips what a late command has missed, and
        # refuses a command that is so late that the arm cannot catch up.
        now = max(now, self.run.joints_stamp)
        knots = _shifted(self.run, self.rest, "hold", np.inf)
        state = Hold(run=self.run, phase="hold", begin=now, end=self._judged_at(now, knots),
                     sent=Reference(now, without_first(knots)))
        return Reaction(state, (Command(*state.sent),))

    def _retreat(self, now: float, outcome: Outcome, reason: str) -> Reaction:
        """Go back from the door, with the outcome and the reason of the whole execution."""
        self.run.stop_requested = False  # a second request stops the retreat itself
        knots = without_first(
            _shifted(self.run, self.rest, "retreat", self.run.settings.back_to_plan))
        state = Retreat(run=self.run, phase="retreat", begin=now, end=self._judged_at(now, knots),
                        sent=Reference(now, knots), outcome_at_end=outcome, reason_at_end=reason)
        return Reaction(state, (Command(0.0, knots),))  # a late retreat begins late

    def _judged_at(self, now: float, knots: Knots) -> float:
        """Time at which a motion that begins now is judged, on the robot's clock [s]."""
        return now + self.run.settings.judged_after + float(knots.time[-1])


def _shifted(run: Run, rest: Array, phase: str, fades_in: float) -> Knots:
    """Shift a phase by the distance of the joints from their planned position at rest.

    A door that stands nearer or farther than planned is hit earlier or later, and the robot comes
    to rest nearer or farther by the same distance. A hold that is shifted by it meets the leaf as
    planned. A retreat leads away from the door, so that its shift can fade.

    Args:
        run: What all states of the execution share.
        rest: Joint positions at rest after the hit, (J,) [rad].
        phase: Name of the phase.
        fades_in: Time in which the shift fades to zero [s]; an infinite time keeps the shift.
    """
    plan = run.plan
    off = rest - plan.phases[AFTER_HIT].position[-1]
    # The shift after a contact outside the steady part is limited to the shift at its edge: a
    # larger one would move joints to the ends of their ranges.
    off *= min(1.0, plan.steady_time / max(abs(run.measured.contact_delay), 1e-9))
    return shifted(plan.phases[phase], off, fades_in)
