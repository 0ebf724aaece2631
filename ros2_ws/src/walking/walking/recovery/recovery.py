"""Recovery from a push: from what was measured to a new walk plan.

While a plan is followed, call at every sample of the driver (200 Hz)

    seen = watch(robot, plan, time, measured, before=seen)
    found = recover(robot, plan, time, measured, previous=found_last, seen=seen)

with the `WalkPlan` that the driver follows, the time since its beginning [s] (the measurement's
stamp minus the plan's), a `Measured` (joints, IMU, wrenches of the feet), and the `Recovery` that
made this plan, None for an undisturbed walk. `seen` is the running estimate of the balance, None at
first; without it the estimate is that of one sample, which trembles by some 20 mm.

The answer is None, nothing is to be done or can be done, or a `Recovery`. Its `plan` ends standing
on two feet and replaces the present one at `begin`, a time since the beginning of the present plan:
send `found.plan.knots` with the stamp of the present plan plus `found.begin`. From then on call
with `plan=found.plan`, times since its own beginning and `previous=found`. `found.landing.margin`
is negative if no landing within the robot's limits stops the fall, as far as can be foreseen; the
plan then has the landing that lacks least.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES, needed
from hrp2_description.support import polygon_margin, support_polygon
from humanoid_motion.errors import HumanoidMotionError
from humanoid_motion.robot_model import RobotModel

from walking.footsteps.footstep import OUTWARD, Pose, Stance, other
from walking.pattern.course import Course
from walking.pattern.settings import WalkSettings
from walking.pattern.walk_plan import WalkPlan
from walking.recovery.adaptation import SHORTEST_SWING, Landing, Swing, landings
from walking.recovery.estimate import Balance, Measured, ReferenceState, reference_at, watch
from walking.recovery.replan import plan_landing

# Lengths are as of HRP-2's sole.
_TRIGGER = 0.035  # error of the capture point from which a walk is changed; else below 12 mm [m]
_AGAIN = 0.025  # error from which a changed walk is changed anew [m]
_PAUSE = 0.02  # shortest time between two changes [s]
_FROZEN = 0.12  # time before a touchdown in which its step is not changed any more [s]
_LATENCY = 0.03  # time from the measurement to the new plan, which takes 20 to 30 ms to make [s]
# On both feet: distance of the capture point from the soles' edge below which a step is made, and
# by how much farther inside such a step must lead [m].
_SPARE, _GAIN = 0.03, 0.015
_UNLOAD = 0.08  # time in which a foot is unloaded before such a step [s]
_TRIES = 4  # largest number of landings that are planned
# After a landing that the legs refuse, one is tried that is later by this time [s], or whose foot
# is slower by this share.
_LONGER, _SLOWER = 0.03, 0.9


@dataclass(frozen=True)
class Recovery:
    """A walk that was changed after a push.

    Attributes:
        plan: The new plan; it ends standing on two feet.
        begin: Its beginning, as a time since the beginning of the plan before it [s].
        landing: Where and when the foot lands.
        expected: Expected course of the CoM at the samples of the plan, (N, 2).
        frequency: Frequency of the pendulum [rad/s].
        passed: Time since the first change after the push [s].
    """

    plan: WalkPlan
    begin: float
    landing: Landing
    expected: Course
    frequency: float
    passed: float

    def capture_point(self, time: float) -> Array:
        """Return the expected capture point at a time since the plan's beginning, (2,) [m]."""
        rows = self.expected.value + self.expected.speed / self.frequency
        times = self.plan.schedule.time
        return np.array([np.interp(time, times, column) for column in rows.T])


def recover(
    robot: RobotModel,
    plan: WalkPlan,
    time: float,
    measured: Measured,
    walk: WalkSettings | None = None,
    previous: Recovery | None = None,
    seen: Balance | None = None,
) -> Recovery | None:
    """Change a walk if a push has moved the capture point too far.

    Args:
        plan: The plan that the driver follows.
        time: Time since its beginning [s].
        measured: What was measured then.
        walk: Settings of the walk; None means the defaults.
        previous: The recovery that made this plan; None for an undisturbed walk.
        seen: What `watch` found at this time; None means that of this sample alone.
    """
    walk = walk or WalkSettings.of(robot)
    seen = seen or watch(robot, plan, time, measured)
    if not _disturbed(robot.config.sole_scale, seen, time, previous):
        return None
    begin = max(time, 0.0) + _LATENCY
    phase = plan.phase_at(begin)
    in_air = phase.kind == "single"
    left = phase.last * plan.schedule.period - begin
    if in_air and left < _FROZEN:
        return None
    if (plan.phase_at(time).kind == "single") != in_air:
        return None  # the foot lands as planned; what is left is judged on both feet
    state = reference_at(robot, plan, begin, walk.chest_swing)
    com, point = _ahead(robot, state, seen)
    frequency = seen.com.frequency
    if in_air:
        swing = Swing(
            phase.swing, phase.stance.foot(other(phase.swing)), state.foot.value[:2],
            state.foot.speed[:2], state.foot.acceleration[:2], plan.footsteps[phase.step].pose,
            left)
        found = landings(robot.config, swing, point, frequency)
    else:
        found = _steps(robot, state.stance, point, frequency)
    passed = 0.0 if previous is None else previous.passed + begin
    for _ in range(_TRIES):
        if not found:
            break
        landing = found[0]
        try:
            new, expected = plan_landing(robot, state, landing, com, frequency, walk, passed)
        except HumanoidMotionError:  # a leg does not reach there in time
            found = [easier for easier in found if easier.time > landing.time + _LONGER
                     or easier.speed < _SLOWER * landing.speed]
            continue
        return Recovery(new, begin, landing, expected, frequency, passed)
    return None


def _disturbed(scale: float, seen: Balance, time: float, previous: Recovery | None) -> bool:
    if previous is None:
        error, limit = seen.capture_point - seen.planned, _TRIGGER * scale
    else:
        error, limit = seen.capture_point - previous.capture_point(time), _AGAIN * scale
        if time < _PAUSE:
            return False
    return float(np.linalg.norm(error)) >= limit


def _ahead(robot: RobotModel, state: ReferenceState, seen: Balance) -> tuple[Array, Array]:
    """Predict CoM and its velocity (2, 2) and the capture point (2,) at the plan's beginning.

    Until then the stabilizer has the ZMP under the capture point, or as near to it as the soles
    allow.
    """
    w, time = seen.com.frequency, _LATENCY
    com, point = seen.com.com, seen.capture_point
    zmp = _nearest(point, _hull(robot, state.stance, state.swing))
    later = zmp + (point - zmp) * np.exp(w * time)
    # c' = w (x - c) under x(t) = zmp + (x - zmp) exp(w t)
    com = (zmp + 0.5 * (point - zmp) * np.exp(w * time)
           + (com - zmp - 0.5 * (point - zmp)) * np.exp(-w * time))
    return np.stack([com, w * (later - com)]), later


def _steps(robot: RobotModel, stance: Stance, point: Array, frequency: float) -> list[Landing]:
    """Return steps from both feet, the best one first; none if the robot can stop without one."""
    inside = float(polygon_margin(point, _hull(robot, stance, "")))
    scale = robot.config.sole_scale
    if inside >= _SPARE * scale:
        return []
    width = needed(robot.config.footsteps, "footsteps").width
    found: list[Landing] = []
    for side in SIDES:
        base = stance.foot(other(side))
        swing = Swing(
            side, base, np.array(stance.foot(side)[:2]), np.zeros(2), np.zeros(2),
            base.moved(0.0, OUTWARD[side] * width), _UNLOAD + SHORTEST_SWING, _UNLOAD)
        found += landings(robot.config, swing, point, frequency)
    return sorted((landing for landing in found if landing.margin >= inside + _GAIN * scale),
                  key=lambda landing: landing.cost)


def _hull(robot: RobotModel, stance: Stance, swing: str) -> Array:
    def corners(side: str, pose: Pose) -> Array:
        return robot.feet[side].corners((pose.x, pose.y, 0.0), pose.yaw)

    return support_polygon(*(corners(side, stance.foot(side)) for side in SIDES if side != swing))


def _nearest(point: Array, hull: Array) -> Array:
    """Return the point of a convex polygon that is nearest to a point, (2,) [m]."""
    if float(polygon_margin(point, hull)) >= 0.0:
        return point
    edges = np.roll(hull, -1, axis=0) - hull
    along = np.clip(((point - hull) * edges).sum(axis=1) / (edges**2).sum(axis=1), 0.0, 1.0)
    places = hull + along[:, None] * edges
    return np.asarray(places[np.argmin(np.linalg.norm(places - point, axis=1))])
