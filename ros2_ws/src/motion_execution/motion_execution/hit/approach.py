"""The states of an execution before the robot goes towards the door."""

from __future__ import annotations

from dataclasses import dataclass

from door_impact_common.arrays import Array
from humanoid_motion.splice import concatenate, duration, slowed
from robot_driver.motion import Outcome

from motion_execution.hit import reasons
from motion_execution.hit.probe import LeafProbe, Searching
from motion_execution.hit.run import Run
from motion_execution.hit.state import Following, Reaction, Reference, State
from motion_execution.hit.states import RunUp, there_and_back
from motion_execution.hit.types import APPROACH, RUN_UP, SCALED


@dataclass(frozen=True, kw_only=True)
class Waiting(State):
    """No command has been sent yet.

    Attributes:
        probe: The probe before the run-up; None if there is none.
    """

    phase: str = APPROACH[0]
    probe: LeafProbe | None = None

    def on_joint_state(self, now: float, position: Array, velocity: Array) -> Reaction:
        """End if a stop is requested."""
        if self.run.stop_requested:
            return self.stop_driver(Outcome.STOPPED, reasons.stopped(self.phase))
        return Reaction(self)

    def start(self, now: float, speed_scale: float) -> Reaction:
        """Send the phases up to the end of run-up or probe, and the way back, as one trajectory.

        Args:
            now: Time of the robot's clock [s].
            speed_scale: Factor on the speed of the phases before the run-up, above 0, at most 1.
        """
        run, parts = self.run, []
        stamp = at = now + run.settings.lead
        for name in SCALED:
            parts.append(slowed(run.plan.phases[name], speed_scale))
            run.starts[name] = at
            at += duration(parts[-1])
        run.starts[run.approach[-1]] = at
        if self.probe is None:
            path, back = run.plan.phases[RUN_UP], run.settings.back_from_miss
        else:
            path, back = self.probe.path, duration(self.probe.path)
        parts.append(there_and_back(path, run.settings.goes_back, back))
        sent = Reference(stamp, concatenate(parts))
        state = Approach.of(run, self.phase, sent, at + duration(path), self.probe)
        return Reaction(state, (sent.from_here(now),))

    def progress(self, now: float) -> float:
        """Share of the first phase that has passed, which is 0."""
        return 0.0


@dataclass(frozen=True, kw_only=True)
class Approach(Following):
    """The robot is in one of the slow phases before the run-up.

    Attributes:
        last: Time at which run-up or probe end at rest, on the robot's clock [s].
        probe: The probe before the run-up; None if there is none.
    """

    last: float
    probe: LeafProbe | None

    @classmethod
    def of(cls, run: Run, phase: str, sent: Reference, last: float,
           probe: LeafProbe | None) -> Approach:
        """Make the state for a slow phase."""
        following = run.approach[run.approach.index(phase) + 1]
        return cls(run=run, phase=phase, begin=run.starts[phase], end=run.starts[following],
                   sent=sent, last=last, probe=probe)

    def on_joint_state(self, now: float, position: Array, velocity: Array) -> Reaction:
        """Change to the next phase at its time, end if a stop is requested, check the joints."""
        run, phase = self.run, self.run.phase_at(now, self.phase)
        if phase == run.approach[-1]:
            begin = run.starts[phase]
            following = RunUp(
                run=run, phase=phase, begin=begin, end=self.last, sent=self.sent
            ) if self.probe is None else Searching(
                run=run, phase=phase, begin=begin, end=self.last, sent=self.sent,
                probe=self.probe)
            return following.on_joint_state(now, position, velocity)
        state = Approach.of(run, phase, self.sent, self.last, self.probe)
        if run.stop_requested:
            return state.stop_driver(Outcome.STOPPED, reasons.stopped(phase))
        return state.compared(now, position)
