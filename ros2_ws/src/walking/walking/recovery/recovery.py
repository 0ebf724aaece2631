"""Ties the recovery together (scratch)."""

from __future__ import annotations

import numpy as np
from humanoid_motion.errors import HumanoidMotionError
from dataclasses import dataclass
from door_impact_common.constants import GRAVITY
from walking.footsteps.footstep import other
from walking.pattern.settings import WalkSettings
from walking.recovery.adaptation import landings
from walking.recovery.estimate import com_over_sole
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
class Recovery:
    plan: object
    begin: float
    landing: object


def recover(robot, plan, time, measured, settings=None, walk=None, previous=None):
    settings, walk = settings or RecoverySettings(), walk or WalkSettings()
    now, reference, phase = error_at(robot, plan, time, measured)
    error = now.capture_point - reference.capture_point
    if phase.kind != "single":
        return None
    if previous is None and np.linalg.norm(error) < settings.trigger:
        return None
    begin = time + settings.latency
    touchdown = phase.last * plan.schedule.period
    if touchdown - begin < 0.08:
        return None
    state = reference_at(robot, plan, begin, walk.chest_swing)
    if not state.swing:
        return None
    w = now.frequency
    standing = phase.stance.foot(other(phase.swing))
    planned = plan.footsteps[phase.step].pose
    found = landings(robot.config, phase.swing, standing, state.foot.value[:2], state.foot.speed[:2], planned,
                     touchdown - begin, _ahead(now, settings, w, robot, phase, standing), w, settings)
    if previous is not None:
        moved = np.hypot(found[0].pose.x - previous.landing.pose.x, found[0].pose.y - previous.landing.pose.y)
        late = abs(time + settings.latency + found[0].time - previous.begin_time - previous.landing.time) if hasattr(previous, "begin_time") else 0.0
        if moved < settings.again and late < 0.03:
            return None
    tried = 0
    for landing in found[:4]:
        tried += 1
        zmp = _inside(robot, phase, standing, now.capture_point, settings)
        com, vel = _advance(now, zmp, settings.latency, w)
        try:
            new = plan_landing(robot, state, landing, com, vel, w, settings, walk, now.height)
        except HumanoidMotionError as problem:
            last = problem
            continue
        return Recovery(new, begin, landing)
    print("refused", last)
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
