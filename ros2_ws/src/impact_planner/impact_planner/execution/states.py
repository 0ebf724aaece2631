"""The states of an execution: which event each one handles, and which state follows.

::

    Waiting -> Approach -> RunUp -> AfterHit -> Hold or Retreat -> Ended
                             |
                             +----> Stopping ----------------------> Ended

From each state a stop, a fall, a missing message or joints that do not follow lead to Ended. From
the point of no return to the door's peak a stop waits, and joints are not compared. A state is
never changed: each handler returns the state that follows, which may be the same one, and the
commands for the driver.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.knots import Knots
from humanoid_motion.splice import concatenate, duration, shifted, slowed, without_first

from impact_planner.execution.run import Run
from impact_planner.execution.types import (
    AFTER_HIT,
    APPROACH,
    MISSED,
    RUN_UP,
    SCALED,
    Command,
    Outcome,
    held_verdict,
    off_track,
    too_far_off,
)
from impact_planner.motion.post import continue_from, to_rest_within


class Reaction(NamedTuple):
    """The answer of a state to an event.

    Attributes:
        state: State that follows.
        commands: Commands for the driver, in the order in which they must be sent.
    """

    state: State
    commands: Sequence[Command] = ()


class Reference(NamedTuple):
    """The trajectory that the driver follows.

    Attributes:
        stamp: Time of the robot's clock at which the time of the knots is 0 [s].
        knots: The trajectory.
    """

    stamp: float
    knots: Knots

    def position(self, now: float) -> Array:
        """Joint positions at a time of the robot's clock, (J,) [rad]."""
        return self.knots.at(now - self.stamp)[0][0]


@dataclass(frozen=True, kw_only=True)
class State:
    """A state of an execution, with the reactions that are the same in most states.

    Attributes:
        run: What all states of the execution share.
        phase: Name of the plan's phase.
        begin: Time at which the phase begins, on the robot's clock [s].
        end: Time at which the phase ends if nothing happens before, on the robot's clock [s].
        outcome: How the execution ended; RUNNING before its end.
        reason: Sentence that explains the outcome; empty where there is nothing to add to it.
    """

    run: Run
    phase: str
    begin: float = np.inf
    end: float = np.inf
    outcome: Outcome = Outcome.RUNNING
    reason: str = ""

    def on_joint_state(self, now: float, position: Array, velocity: Array) -> Reaction:
        """React to joint positions, (J,) [rad], and joint speeds, (J,) [rad/s]."""
        return Reaction(self)

    def on_foot_forces(self, now: float, force: float) -> Reaction:
        """React to the floor's force on both feet towards the door [N]."""
        return Reaction(self)

    def on_door(self, now: float, angle: float, velocity: float) -> Reaction:
        """React to an angle [rad] and an angular velocity [rad/s] of the door."""
        return Reaction(self)

    def on_tilt(self, tilt: float) -> Reaction:
        """React to a tilt of the trunk [rad]: stop the driver when the robot falls."""
        if tilt > self.run.settings.fall_tilt:
            return self.stop_driver(Outcome.FELL)
        return Reaction(self)

    def on_silence(self, now: float, topic: str, seconds: float) -> Reaction:
        """React to a topic without a message: stop the driver if the robot keeps its balance."""
        silence = f"{topic} has been silent for {seconds:.2f} s in the phase {self.phase}"
        if self.past_no_return(now):
            return self.give_up(f"given up, the driver finishes what it was sent: {silence}")
        return self.stop_driver(Outcome.STOPPED, f"stopped: {silence}")

    def past_no_return(self, now: float) -> bool:
        """Whether a stop at this time would lose balance, so that the hit must be completed."""
        return self.run.past_no_return(now)

    def progress(self, now: float) -> float:
        """Share of the phase that has passed, 0 to 1."""
        return float(np.clip((now - self.begin) / max(self.end - self.begin, 1e-9), 0.0, 1.0))

    # -- transitions to the end -----------------------------------------------------------------

    def give_up(self, reason: str) -> Reaction:
        """End as stopped, without a command to the driver."""
        return self.ended(Outcome.STOPPED, reason)

    def stop_driver(self, outcome: Outcome, reason: str = "") -> Reaction:
        """End with the driver's own stop."""
        return Reaction(self.ended(outcome, reason).state, (Command(0.0, None),))

    def ended(self, outcome: Outcome, reason: str) -> Reaction:
        """End without a command to the driver, which finishes its trajectory."""
        return Reaction(Ended(run=self.run, phase=self.phase, begin=self.begin, end=self.end,
                              outcome=outcome, reason=reason))


@dataclass(frozen=True, kw_only=True)
class Waiting(State):
    """Nothing has been sent yet."""

    phase: str = APPROACH[0]

    def on_joint_state(self, now: float, position: Array, velocity: Array) -> Reaction:
        """Stop as requested."""
        if self.run.stop_requested:
            return self.stop_driver(Outcome.STOPPED, _as_asked(self.phase))
        return Reaction(self)

    def start(self, now: float, speed_scale: float) -> Reaction:
        """Send the phases up to the end of the run-up as one trajectory.

        Args:
            now: Time of the robot's clock [s].
            speed_scale: Factor on the speed of the phases before the run-up, 0 to 1.
        """
        run, parts = self.run, []
        stamp = at = now + run.settings.lead
        for name in APPROACH:
            knots = run.plan.phases[name]
            if name in SCALED:
                knots = slowed(knots, speed_scale)
            run.starts[name] = at
            at += duration(knots)
            parts.append(knots)
        sent = Reference(stamp, concatenate(parts))
        return Reaction(Approach.of(run, self.phase, sent, at), (Command(*sent),))

    def progress(self, now: float) -> float:
        """Nothing of the first phase has passed."""
        return 0.0


@dataclass(frozen=True, kw_only=True)
class Approach(State):
    """The slow phases before the run-up.

    Attributes:
        sent: Everything up to the end of the run-up.
        run_up_end: Time at which the run-up ends at rest, on the robot's clock [s].
    """

    sent: Reference
    run_up_end: float

    @classmethod
    def of(cls, run: Run, phase: str, sent: Reference, run_up_end: float) -> Approach:
        """The state in the slow phase of this name."""
        following = APPROACH[APPROACH.index(phase) + 1]
        return cls(run=run, phase=phase, begin=run.starts[phase], end=run.starts[following],
                   sent=sent, run_up_end=run_up_end)

    def on_joint_state(self, now: float, position: Array, velocity: Array) -> Reaction:
        """Go on to the next phase by the clock; stop as requested; check the joints."""
        run, phase = self.run, self.run.phase_at(now, self.phase)
        if phase == RUN_UP:
            return RunUp(run=run, phase=phase, begin=run.starts[phase], end=self.run_up_end,
                         sent=self.sent).on_joint_state(now, position, velocity)
        state = Approach.of(run, phase, self.sent, self.run_up_end)
        if run.stop_requested:
            return state.stop_driver(Outcome.STOPPED, _as_asked(phase))
        run.on_joints(now, position, velocity, phase)
        return _compared(state, now, position)


@dataclass(frozen=True, kw_only=True)
class RunUp(State):
    """The run-up; the driver's trajectory goes on past the planned contact and comes to rest.

    Attributes:
        sent: Everything up to the end of the run-up.
    """

    sent: Reference

    def on_joint_state(self, now: float, position: Array, velocity: Array) -> Reaction:
        """Stop as requested; end where the contact is missed; check the joints."""
        run = self.run
        past_no_return = self.past_no_return(now)
        if run.stop_requested and not past_no_return:
            return self._stop(now)
        run.on_joints(now, position, velocity, self.phase)
        if now > self.end + run.settings.late:
            return self.ended(Outcome.NO_CONTACT, MISSED)
        return Reaction(self) if past_no_return else _compared(self, now, position)

    def on_foot_forces(self, now: float, force: float) -> Reaction:
        """Detect the contact by a force while the planned speed is constant.

        Outside this time the floor's force is that of the run-up itself.
        """
        run, settings = self.run, self.run.settings
        begin = now - settings.felt_after
        steady = run.plan.steady_time + settings.splice
        if abs(begin - run.planned_contact) <= steady and force >= settings.felt_force:
            return self._contact(begin)
        return Reaction(self)

    def on_door(self, now: float, angle: float, velocity: float) -> Reaction:
        """Detect by the door's speed a contact that the feet did not show."""
        if velocity > self.run.settings.door_moves:
            return self._contact(now)
        return Reaction(self)

    def _contact(self, begin: float) -> Reaction:
        """Switch to the motion after the hit.

        Args:
            begin: Begin of the contact on the robot's clock [s].
        """
        run, plan, cam = self.run, self.run.plan, self.run.plan.phases[RUN_UP]
        # A contact that is detected late makes the switch late, too.
        stamp = max(begin + plan.switch_delay, run.joints_stamp + run.settings.splice)
        path_time = float(np.clip(stamp - self.begin, 0.0, cam.time[-1]))
        knots = to_rest_within(
            cam, path_time, plan.post_ratio, plan.rest_duration, plan.slow_down)
        measured = run.measured
        measured.contact_time = begin
        measured.contact_delay = begin - run.planned_contact
        measured.switch_latency = stamp - begin
        state = AfterHit(run=run, phase=AFTER_HIT, begin=stamp, end=stamp + duration(knots),
                         sent=Reference(stamp, knots))
        return Reaction(state, (Command(stamp, knots),))

    def _stop(self, now: float) -> Reaction:
        """Slow the run-up down to rest as planned: the driver's own stop is too hard for it."""
        run, settings = self.run, self.run.settings
        run.stop_requested = False
        stamp = now + settings.splice
        knots = continue_from(
            run.plan.phases[RUN_UP], stamp - self.begin, 1.0, run.plan.stop_duration)
        state = Stopping(run=run, phase=self.phase, begin=self.begin, end=self.end,
                         sent=Reference(stamp, knots),
                         at_rest=stamp + duration(knots) + settings.settle)
        return Reaction(state, (Command(stamp, knots),))


@dataclass(frozen=True, kw_only=True)
class Stopping(State):
    """The run-up is being slowed down to rest; forces and the door have no effect any more.

    Attributes:
        sent: Motion to rest.
        at_rest: Time at which the robot is at rest, on the robot's clock [s].
    """

    sent: Reference
    at_rest: float

    def on_joint_state(self, now: float, position: Array, velocity: Array) -> Reaction:
        """Check the joints until the robot is at rest."""
        if now < self.at_rest:
            return _compared(self, now, position)
        return self.ended(Outcome.STOPPED, _as_asked(self.phase))

    def past_no_return(self, now: float) -> bool:
        """A robot that is stopping can be stopped at any time."""
        return False


@dataclass(frozen=True, kw_only=True)
class AfterHit(State):
    """The robot comes to rest while the door opens to its peak.

    Attributes:
        sent: Motion to rest.
    """

    sent: Reference

    def on_joint_state(self, now: float, position: Array, velocity: Array) -> Reaction:
        """Stop if that is possible; go back where the door shows no peak; check the joints."""
        run = self.run
        past_no_return = self.past_no_return(now)
        if run.stop_requested and not past_no_return:
            return self.stop_driver(Outcome.STOPPED, _as_asked(self.phase))
        longest = run.settings.slower * duration(run.plan.phases[AFTER_HIT])
        if now > self.begin + longest:
            return self._go_back(now, "the door was not seen to turn round within "
                                 f"{longest:.1f} s after the hit")
        run.on_joints(now, position, velocity, self.phase)
        return Reaction(self) if past_no_return else _compared(self, now, position)

    def on_door(self, now: float, angle: float, velocity: float) -> Reaction:
        """Follow the opening; after the door's peak hold it, retreat or stop."""
        run, plan, measured = self.run, self.run.plan, self.run.measured
        measured.omega_door = float(np.fmax(measured.omega_door, velocity))
        if not measured.peak_angle >= angle:
            measured.peak_angle, measured.peak_time = angle, now - measured.contact_time
        if measured.peak_angle - angle < run.settings.peak_drop:
            return Reaction(self)
        run.turned_round = True
        off = measured.peak_angle - plan.desired_angle
        if plan.ending == "hold" and abs(off) > run.settings.hold_within:
            return self._go_back(now, too_far_off(measured.peak_angle, plan.desired_angle))
        if run.stop_requested and "retreat" not in plan.phases:
            return replace(self, phase=plan.ending).stop_driver(
                Outcome.STOPPED, "stopped after the hit, as asked")
        if plan.ending == "retreat":
            return self._retreat(
                now, Outcome.SUCCESS, "the door was opened, the robot went back")
        if run.stop_requested:
            return self._retreat(
                now, Outcome.STOPPED, "stopped after the hit, back from the door")
        return self._hold(now)

    def _go_back(self, now: float, why: str) -> Reaction:
        """Retreat where the plan's ending makes no sense; stop where the plan has no retreat."""
        if "retreat" not in self.run.plan.phases:
            return self.stop_driver(Outcome.NOT_HELD, why)
        return self._retreat(now, Outcome.NOT_HELD, f"{why}; the robot went back")

    def _hold(self, now: float) -> Reaction:
        """Put the hand on the door."""
        knots = self._shifted("hold", np.inf)
        state = Hold(run=self.run, phase="hold", begin=now, end=self._end(now, knots),
                     sent=Reference(now, knots))
        return Reaction(state, (Command(0.0, knots),))

    def _retreat(self, now: float, outcome: Outcome, reason: str) -> Reaction:
        """Go back from the door; the outcome and its reason are known already."""
        self.run.stop_requested = False  # a second request stops the retreat itself
        knots = self._shifted("retreat", self.run.settings.back_to_plan)
        state = Retreat(run=self.run, phase="retreat", begin=now, end=self._end(now, knots),
                        sent=Reference(now, knots), outcome_at_end=outcome, reason_at_end=reason)
        return Reaction(state, (Command(0.0, knots),))

    def _end(self, now: float, knots: Knots) -> float:
        """Time at which a motion that begins now is judged, on the robot's clock [s]."""
        return now + self.run.settings.judged_after + float(knots.time[-1])

    def _shifted(self, phase: str, fades_in: float) -> Knots:
        """The phase after the peak, shifted by the joints' distance from the planned rest.

        A door that stood nearer or farther than planned is hit earlier or later, and the robot
        comes to rest elsewhere. A shifted hold meets the leaf as planned, from a body that stands
        to it as planned. A retreat leads far away and returns to the plan.

        Args:
            phase: Name of the phase.
            fades_in: Time in which the shift fades [s]; an infinite time keeps it.
        """
        plan = self.run.plan
        off = self.sent.knots.position[-1] - plan.phases[AFTER_HIT].position[-1]
        # A contact outside the steady part would shift joints to the ends of their ranges.
        off *= min(1.0, plan.steady_time / max(abs(self.run.measured.contact_delay), 1e-9))
        # The driver begins at its present reference in place of the first knot. The command has no
        # stamp, so that one that arrives late begins late and is not refused.
        return shifted(without_first(plan.phases[phase]), off, fades_in)


@dataclass(frozen=True, kw_only=True)
class _Ending(State):
    """A motion after the door's peak, which can be stopped at any time.

    Attributes:
        sent: The motion.
    """

    sent: Reference

    def on_joint_state(self, now: float, position: Array, velocity: Array) -> Reaction:
        """Stop as requested; judge the end."""
        run = self.run
        if run.stop_requested:
            return self.stop_driver(Outcome.STOPPED, _as_asked(self.phase))
        if now < self.end:
            return Reaction(self)
        why = off_track(position, self.sent.knots.position[-1], run.joint_names,
                        run.settings.tracking, f"the {self.phase} ends")
        if why:
            return self.ended(Outcome.NOT_FOLLOWED, why)
        return self._judged()

    def past_no_return(self, now: float) -> bool:
        """The robot stands: a stop keeps its balance."""
        return False

    def _judged(self) -> Reaction:
        """The end of a motion that the joints have followed."""
        raise NotImplementedError


@dataclass(frozen=True, kw_only=True)
class Hold(_Ending):
    """The hand catches the door and holds it."""

    def _judged(self) -> Reaction:
        """Succeed where the door stands still near the desired angle."""
        run, angles = self.run, self.run.door.recent
        run.measured.held_angle = float(np.mean(angles))
        return self.ended(*held_verdict(
            angles, run.plan.desired_angle, run.settings.held_within))


@dataclass(frozen=True, kw_only=True)
class Retreat(_Ending):
    """The robot goes back from the door.

    Attributes:
        outcome_at_end: Outcome of the execution if the joints follow.
        reason_at_end: Reason of this outcome.
    """

    outcome_at_end: Outcome
    reason_at_end: str

    def _judged(self) -> Reaction:
        """End with the outcome that was known when the retreat began."""
        return self.ended(self.outcome_at_end, self.reason_at_end)


@dataclass(frozen=True, kw_only=True)
class Ended(State):
    """The execution is over: no event has an effect."""

    def on_tilt(self, tilt: float) -> Reaction:
        """Ignore the tilt."""
        return Reaction(self)

    def on_silence(self, now: float, topic: str, seconds: float) -> Reaction:
        """Ignore a topic without a message."""
        return Reaction(self)

    def past_no_return(self, now: float) -> bool:
        """No motion is left to complete."""
        return False

    def ended(self, outcome: Outcome, reason: str) -> Reaction:
        """Keep the outcome."""
        return Reaction(self)


def _compared(state: Approach | RunUp | Stopping | AfterHit, now: float,
              position: Array) -> Reaction:
    """Stop the driver where a joint, of (J,) [rad], is too far from the reference."""
    run = state.run
    why = off_track(position, state.sent.position(now), run.joint_names, run.settings.tracking,
                    "it was sent")
    if not why:
        return Reaction(state)
    return state.stop_driver(
        Outcome.NOT_FOLLOWED, f"stopped in the phase {state.phase}: {why}")


def _as_asked(phase: str) -> str:
    return f"stopped in the phase {phase}, as asked"
