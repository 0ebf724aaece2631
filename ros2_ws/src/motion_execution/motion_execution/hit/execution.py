"""Runs a plan: decides from measurements what to send to the driver, and when.

`Execution` is a state machine without ROS. The caller passes on the measurements of robot and door,
and sends the trajectories that are returned to the driver:

- The phases up to the end of the run-up are sent as one trajectory. With a probe they end with
  that, and the run-up is sent when the leaf has been found.
- The contact is detected by the IMU, the feet or the door's encoder. The motion after the hit
  begins a fixed time after the contact, wherever the door stands.
- Without a contact the run-up comes to rest by itself, and the robot goes back.
- The hold or the retreat begins after the measured peak of the door's angle.

The module `states` holds the states with their handlers. `Execution` passes each event to the
present state; every command passes `_enter` on its way to the driver.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from door_impact_common.arrays import Array
from humanoid_motion import samples
from humanoid_motion.driver_interface import Command
from impact_planner.errors import InvalidRequest
from robot_driver.motion import Motion, Outcome, failed, silent

from motion_execution.hit.approach import Waiting
from motion_execution.hit.contact import ContactDetector
from motion_execution.hit.point_b import PointB
from motion_execution.hit.probe import LeafProbe
from motion_execution.hit.run import Run
from motion_execution.hit.state import Reaction, State
from motion_execution.hit.types import (
    APPROACH,
    PROBE,
    RUN_UP,
    SCALED,
    ExecutablePlan,
)
from motion_execution.settings import ExecutionSettings


class Execution(Motion):
    """One run of a plan.

    Times are stamps of messages or times of the robot's clock, both in seconds. The stamps of joint
    states must not decrease: a caller whose clock goes back must call `give_up`.

    Args:
        plan: The plan.
        point_b: Kinematics of point B.
        settings: Thresholds; None means the default thresholds.
        speed_scale: Factor on the speed of the phases before the run-up, above 0 and at most 1.
        joint_names: Joint names in the order of the knots' columns; empty if `reason` need not name
            joints.
        probe: Whether the elbow touches the leaf slowly before the run-up.

    Attributes:
        phase: Name of the present phase.
        measured: Measurements until now.
        starts: When each phase began or will begin, by its name, on the robot's clock [s].

    Raises:
        InvalidRequest: The speed scale is out of range, or the run-up too short for a probe.
    """

    def __init__(
        self, plan: ExecutablePlan, point_b: PointB,
        settings: ExecutionSettings | None = None, speed_scale: float = 1.0,
        joint_names: Sequence[str] = (), *, probe: bool = False,
    ) -> None:
        if not 0.0 < speed_scale <= 1.0:
            raise InvalidRequest(
                f"speed_scale is {speed_scale:g}, must be above 0 and at most 1",
                quantity="speed_scale", value=speed_scale, limit=(0.0, 1.0))
        settings = settings or ExecutionSettings()
        # The trunk turns so little in the run-up that its direction at the contact is used.
        at_contact = plan.phases[RUN_UP].at(plan.contact_time)[0][0]
        away = point_b.away_from_door(at_contact)
        self._run = Run(plan, settings, joint_names, point_b.speed,
                        ContactDetector(settings, away), (*SCALED, PROBE) if probe else APPROACH)
        self._speed_scale = speed_scale
        self._waiting = Waiting(run=self._run, probe=LeafProbe(
            plan, settings, away, point_b.reach) if probe else None)
        self._state: State = self._waiting
        self.phase, self.measured, self.starts = (
            self._waiting.phase, self._run.measured, self._run.starts)

    # -- state and measurements -----------------------------------------------------------------

    @property
    def door_angle(self) -> float:
        """Last accepted angle of the door [rad]; 0 before the first one."""
        return self._run.door_angle

    @property
    def turned_round(self) -> bool:
        """Whether the door's peak was detected."""
        return self._run.turned_round

    @property
    def planned_contact(self) -> float:
        """Time of the planned contact on the robot's clock [s]; infinite while a probe goes on."""
        return self._run.planned_contact

    def past_no_return(self, now: float) -> bool:
        """Whether a stop would lose balance, so that the hit must be completed.

        This is so from shortly before the hit until the door's peak. The motions after the peak can
        be stopped again.

        Args:
            now: Time of the robot's clock [s].
        """
        return self._state.past_no_return(now)

    def progress(self, now: float) -> float:
        """Share of the present phase that has passed at a time of the robot's clock [s], 0 to 1."""
        return self._state.progress(now)

    def lags(self, seconds: float) -> None:
        """Set the time by which the next events lag behind the present [s], at least 0.

        Commands that depend on an event are sent only if this time is short.
        """
        self._run.lag = seconds

    # -- requests -------------------------------------------------------------------------------

    def start(self, now: float) -> Command:
        """Start, and return one trajectory of all phases up to the end of the run-up.

        Args:
            now: Time of the robot's clock [s].
        """
        (command,) = self._enter(self._waiting.start(now, self._speed_scale))
        return command

    def stop(self, why: str = "") -> None:
        """Request a stop, which begins at the next joint state.

        Past the point of no return the hit is completed before the robot retreats.

        Args:
            why: Not used: `reason` says in which phase the motion was stopped.
        """
        self._run.stop_requested = True

    def give_up(self, why: str) -> None:
        """End as stopped, without a command to the driver."""
        self._enter(self._state.give_up(why))

    # -- events: each handler returns commands, which must be sent in their order ---------------

    def on_joints(self, now: float, position: Array, velocity: Array) -> list[Command]:
        """Handle joint positions [rad] and speeds [rad/s], (J,) each."""
        self._run.joints_stamp = now
        return self._enter(self._state.on_joint_state(now, position, velocity))

    def on_wrenches(self, now: float, left: Array, right: Array) -> list[Command]:
        """Handle the wrenches of the floor on both feet, (6,) each [N, N m].

        The force on both feet towards the door is positive in a hit: the leaf pushes the robot away
        from the door, and the legs, which keep their speed, push the floor the same way. The soles
        are parallel to odom, in which the door is in the direction of -y.
        """
        return self._enter(self._state.on_foot_forces(now, -float(left[1] + right[1])))

    def on_door(self, now: float, angle: float, velocity: float) -> list[Command]:
        """Handle an angle of the door.

        An angle is ignored if its stamp is too far from that of the last joint state.

        Args:
            now: Stamp of the angle [s].
            angle: Angle of the door [rad].
            velocity: Angular velocity of the door [rad/s].
        """
        if abs(now - self._run.joints_stamp) > self._run.settings.stale:
            return []
        self._run.door_angles.append(angle)
        return self._enter(self._state.on_door(now, angle, velocity))

    def on_imu(self, now: float, tilt: float, force: Array) -> list[Command]:
        """Handle a reading of the IMU."""
        commands = self._enter(self._state.on_tilt(tilt))
        if force.any():
            commands += self._enter(self._state.on_specific_force(now, force))
        return commands

    def on_measured(self, now: float, measured: samples.Measured) -> list[Command]:
        """Measure the speed of B."""
        self._run.on_measured(now, measured, self._state.phase)
        return []

    def on_silence(self, now: float, topic: str, waited: float, limit: float) -> list[Command]:
        """Handle a topic without a message for a time [s] that exceeds its limit [s]."""
        return self._enter(
            self._state.on_silence(now, silent(topic, waited, limit)))

    def on_refusal(self, now: float, why: str) -> list[Command]:
        """Handle a command that the controller does not follow, for a reason in words."""
        state, commands = self._state.on_silence(now, why)
        if state.outcome is Outcome.STOPPED:
            state = replace(state, outcome=Outcome.NOT_FOLLOWED)
        return self._enter(Reaction(state, commands))

    def on_failure(self, now: float, error: Exception) -> list[Command]:
        """Handle an error of the program: stop the driver if the robot keeps its balance.

        Args:
            now: Time of the robot's clock [s].
            error: The error.
        """
        try:
            return self._enter(self._state.on_silence(now, failed(error)))
        except Exception:  # what failed once may fail again
            self.give_up(failed(error))
            return []

    def _enter(self, reaction: Reaction) -> list[Command]:
        """Enter the state that follows an event, and return the commands."""
        before, self._state = self._state, reaction.state
        self.outcome, self.reason, self.phase = (
            self._state.outcome, self._state.reason, self._state.phase)
        if self._state is not before and self.running:
            self.starts.setdefault(self._state.phase, self._state.begin)
        return list(reaction.commands)
