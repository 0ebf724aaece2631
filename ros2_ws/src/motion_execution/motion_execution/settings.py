"""Limits and waiting times with which hits and walks are executed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from door_impact_common.errors import SettingError
from humanoid_motion.robot_model import RobotModel


@dataclass(frozen=True)
class ExecutionSettings:
    """Thresholds of the execution.

    Attributes:
        lead: Time from sending the first trajectory to its start, which a loaded machine needs [s].
            Within it the driver goes from its present reference to the first posture of a walk.
        splice: Time from handling a measurement to the driver's reaction [s].
        settle: Time after the end of a motion at which the robot is at rest [s].
        fall_tilt: Tilt of the trunk above which the robot has fallen [rad].
        tracking: Largest distance between a joint and the trajectory of a hit [rad].
        walk_tracking: The same in a walk [rad]; a push that the robot withstands bends an ankle by
            up to 0.2 rad.

        judged_after: Time from the end of the hold or the retreat to its judgement [s].
        felt_force: Force of the floor on the feet towards the door above which a contact is
            detected [N]; HRP-2's by default.
        contact_deceleration: Specific force of the trunk away from the door, above what the run-up
            needs, from which on a reading shows a contact if the one before it has risen already
            [m/s^2]. In the simulation the readings of the run-up differ by at most 0.2, the second
            one of a hit by 18 to 39.
        force_delay: Time from the begin of the contact to the stamp of the wrenches that show it
            [s]. On gears that give, a mean over a tick of the driver exceeds `felt_force` 9 to
            16 ms after the begin.
        door_moves: Angular velocity of the door above which a contact is detected that the feet
            did not show [rad/s].
        late: Time after the end of the run-up at which a contact counts as missed [s]. The angle
            of a door that moves may arrive late.
        after_hit: Times after the begin of the contact between which v'_rB is measured [s]. Before
            them B trembles on gears that give, after them the legs have slowed it down.
        peak_drop: Angle by which the door must fall back for its peak to be detected [rad].
        back_to_plan: Time within which a retreat from a door that stood nearer or farther returns
            to the plan [s].
        hold_within: Largest distance between the door's peak and the desired angle at which the
            arm catches the door [rad].
        late_event: Largest delay of an event at which the command that depends on it is still sent
            [s]: of a contact, and of the door's peak beyond the delay that the hold is planned for.
        goes_back: Time from the planned peak of the door, or from the end of a run-up without a
            contact, to the retreat that the driver begins by itself if no command arrives [s].
        back_from_miss: Duration of the retreat along the run-up after a missed contact [s].
        stale: Largest difference between the stamps of the door's angle and of the joints [s].
        held_within: Largest distance between the door and the desired angle at the end [rad].

        commit: Time before a step at which the motion of the step is sent [s]. Until then the
            driver has a trajectory that ends with the robot standing on two feet before this step.
        latest: Time after the begin of a step up to which its motion can still be sent [s]. The
            motions with and without the step differ by less than 0.1 mm of the CoM until then.
        planning: Time that is kept for the planning of new footsteps while the robot walks [s].
        apart: Distance between a trajectory and the one before it, over all joints, from which on
            the joints tell which of the two the driver follows [rad].
        missed: Share of the way from the earlier one to the later below which the driver has
            missed the later one.
        leaning: Tilt of the trunk above which `walk_tracking` is not judged [rad]: a push or a fall
            has moved the joints, and the driver is not to blame.
        restarts: How often a walk that came to rest because a message was late is taken up again.

    Raises:
        SettingError: A threshold of the contact is not a finite number above 0.
    """

    lead: float = 0.5
    splice: float = 0.005
    settle: float = 0.1
    fall_tilt: float = math.radians(30.0)
    tracking: float = 0.1
    walk_tracking: float = 0.3

    judged_after: float = 0.2
    felt_force: float = 80.0
    contact_deceleration: float = 5.0
    force_delay: float = 0.012
    door_moves: float = 0.15
    late: float = 0.1
    after_hit: tuple[float, float] = (0.045, 0.09)
    peak_drop: float = 0.0009
    back_to_plan: float = 0.6
    hold_within: float = math.radians(6.0)
    late_event: float = 0.1
    goes_back: float = 0.5
    back_from_miss: float = 2.5
    stale: float = 2.0
    held_within: float = math.radians(2.0)

    commit: float = 0.2
    latest: float = 0.01
    planning: float = 0.5
    apart: float = 0.15
    missed: float = 0.25
    leaning: float = math.radians(5.0)
    restarts: int = 5

    @classmethod
    def of(cls, robot: RobotModel, **own: Any) -> ExecutionSettings:
        """Return HRP-2's thresholds, forces by a robot's mass, and `own` as it is."""
        return cls(**{"felt_force": robot.config.mass_scale * cls.felt_force} | own)

    def __post_init__(self) -> None:
        """Check the thresholds that are parameters of a node."""
        for name, unit in (("felt_force", "N"), ("contact_deceleration", "m/s^2")):
            if not 0.0 < getattr(self, name) < math.inf:
                raise SettingError(f"{name} [{unit}]", getattr(self, name), "finite and above 0")
