"""Recovery from a push: from what was measured to a new walk plan.

Call `recover` at every sample of the driver (200 Hz) while a plan is followed:

    found = recover(robot, plan, time, measured, settings, walk, previous)

with the `WalkPlan` that the driver follows, the time since its beginning [s] (the measurement's
stamp minus the plan's), a `Measured` (joints, IMU, foot wrenches; see `estimate.py`), the settings,
and the `Recovery` that made this plan, or None for an undisturbed walk. The answer is None (nothing
to do) or a `Recovery`, whose `plan` (a `WalkPlan` that ends standing on two feet) replaces the
present one at `begin`: the time since the beginning of the present plan [s]. Send `found.plan.knots`
with the stamp of the present plan plus `found.begin`; from then on call with `plan=found.plan`, time
since its own beginning, and `previous=found`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from hrp2_description.support import polygon_margin, support_polygon
from humanoid_motion.errors import HumanoidMotionError

from walking.footsteps.footstep import OUTWARD, other
from walking.pattern.settings import WalkSettings
from walking.recovery.adaptation import landings
from walking.recovery.estimate import ComState, com_over_sole
from walking.recovery.reference import reference_at, phase_at
from walking.recovery.replan import plan_landing
from walking.recovery.settings import RecoverySettings


def error_at(robot, plan, time, measured):
    phase = phase_at(plan, time)
    if phase.kind == "single":
        side = phase.sides[0]
    else:
        side = "left" if measured.left_wrench[2] >= measured.right_wrench[2] else "right"
    sole = phase.stance.foot(side)
    now = com_over_sole(robot, side, sole, measured.position, measured.velocity, measured.imu)
    position, velocity, _ = plan.knots.at(time)
    reference = com_over_sole(robot, side, sole, position[0], velocity[0], None)
    return now, reference, phase


@dataclass(frozen=True)
class Watch:
    """What is known of the robot's balance at one time."""

    time: float
    com: object
    point: np.ndarray
    error: np.ndarray
    phase: object

    @property
    def frequency(self):
        return self.com.frequency


def watch(robot, plan, time, measured, settings, before=None, previous=None):
    now, reference, phase = error_at(robot, plan, max(time, 0.0), measured)
    point = now.capture_point
    if before is not None:
        w = now.frequency
        zmp = zmp_measured(phase, measured)
        dt = 0.005
        guess = before.point if zmp is None else before.point + dt * w * (before.point - zmp)
        point = guess + dt / (dt + settings.filter) * (point - guess)
    expected = reference.capture_point if previous is None else previous.expected_point(time)
    return Watch(time, now, point, point - expected, phase)


def zmp_measured(phase, measured):
    force, moment = 0.0, np.zeros(2)
    for side, wrench in (("left", measured.left_wrench), ("right", measured.right_wrench)):
        if wrench[2] > 30.0:
            place = phase.stance.foot(side).moved(-wrench[4] / wrench[2], wrench[3] / wrench[2])
            force += wrench[2]
            moment += wrench[2] * np.array(place[:2])
    return moment / force if force > 100.0 else None


@dataclass(frozen=True)
class Recovery:
    plan: object
    begin: float
    landing: object
    expected: object
    frequency: float
    gone: float = 0.0

    def expected_point(self, time):
        """Expected capture point at a time since the beginning of the plan (2,)."""
        n = min(max(time, 0.0) / self.plan.schedule.period, len(self.expected.value) - 1.0)
        i = min(int(n), len(self.expected.value) - 2)
        f = n - i
        rows = self.expected.value + self.expected.speed / self.frequency
        return rows[i] * (1 - f) + rows[i + 1] * f


def recover(robot, plan, seen, settings=None, walk=None, previous=None):
    settings, walk = settings or RecoverySettings(), walk or WalkSettings()
    now, phase, time = seen.com, seen.phase, seen.time
    now = ComState(now.com, (seen.point - now.com) * now.frequency, now.height)
    if previous is not None and time < settings.pause:
        return None
    if np.linalg.norm(seen.error) < (settings.trigger if previous is None else settings.again):
        return None
    begin = time + settings.latency
    touchdown = phase.last * plan.schedule.period
    state = reference_at(robot, plan, begin, walk.chest_swing)
    w = now.frequency
    if phase.kind == "single":
        left = touchdown - begin
        if left < settings.frozen:
            return None
        standing = phase.stance.foot(other(phase.swing))
        planned = plan.footsteps[phase.step].pose
        zmp = _inside(robot, phase, standing, now.capture_point, settings)
        com, vel = _advance(now, zmp, settings.latency, w)
        found = landings(robot.config, phase.swing, standing, state.foot.value[:2],
                         state.foot.speed[:2], state.foot.acceleration[:2], planned, touchdown - begin, com + vel / w, w, settings)[:4]
    else:
        middle = now.com - state.com.acceleration / w**2
        hull = support_polygon(*(robot.feet[side].corners(phase.stance.foot(side)[:2], phase.stance.foot(side).yaw) for side in ("left", "right")))
        zmp = nearest_inside(now.capture_point, hull)
        com, vel = _advance(now, zmp, settings.latency, w)
        point = com + vel / w
        found = []
        here = float(polygon_margin(point, hull))
        if here < settings.hold:
            found = []
            for swing in ("left", "right"):
                standing = phase.stance.foot(other(swing))
                foot = phase.stance.foot(swing)
                aim = standing.moved(0.0, OUTWARD[swing] * robot.config.footsteps.width)
                found += landings(robot.config, swing, standing, np.array(foot[:2]), np.zeros(2), np.zeros(2), aim,
                                  settings.double + settings.swing, point, w, settings, settings.double)[:4]
            found.sort(key=lambda one: one.cost)
            found = [one for one in found[:4] if one.margin > settings.hopeless]
    gone = 0.0 if previous is None else previous.gone + begin
    last = None
    for landing in found:
        try:
            new, expected = plan_landing(robot, state, landing, com, vel, w, settings, walk, now.height, gone)
        except HumanoidMotionError as problem:
            last = problem
            continue
        return Recovery(new, begin, landing, expected, w, gone)
    return None


def _inside(robot, phase, standing, point, settings):
    rect = robot.config.soles[other(phase.swing)]
    from walking.footsteps.footstep import Pose
    local = Pose(*point, 0.0).seen_from(standing)
    x = min(max(local.x, rect[0] + settings.inset), rect[1] - settings.inset)
    y = min(max(local.y, rect[2] + settings.inset), rect[3] - settings.inset)
    return np.array(standing.moved(x, y)[:2])


def _advance(now, zmp, dt, w):
    c, s = np.cosh(w * dt), np.sinh(w * dt)
    away = now.com - zmp
    return zmp + away * c + now.velocity / w * s, away * w * s + now.velocity * c


def _ahead(now, settings, w, robot, phase, standing):
    zmp = _inside(robot, phase, standing, now.capture_point, settings)
    com, vel = _advance(now, zmp, settings.latency, w)
    return com + vel / w


def nearest_inside(point, hull):
    if float(polygon_margin(point, hull)) >= 0.0:
        return point
    after = np.roll(hull, -1, axis=0)
    edges = after - hull
    along = np.clip(((point - hull) * edges).sum(axis=1) / (edges**2).sum(axis=1), 0.0, 1.0)
    places = hull + along[:, None] * edges
    return places[np.argmin(np.linalg.norm(places - point, axis=1))]
