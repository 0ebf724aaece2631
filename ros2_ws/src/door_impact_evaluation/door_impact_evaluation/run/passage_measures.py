"""Measure a passage: here are the definitions of "passage" in `summary.json`.

Clear is the first instant at which all bodies of the robot are past the wall and outside the leaf's
circle. The door is passed by a robot that is clear, then stands for 2 s, never falls, and never
touches frame or wall. The hand holds the leaf from the catch, the first contact after the door's
peak (after a push the first one at all), up to the planned release.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.robot_model import RobotModel
from numpy.typing import NDArray
from walking.passing.checks import holding_links

from door_impact_evaluation.run import evaluation
from door_impact_evaluation.run.body_distances import BodyDistances
from door_impact_evaluation.run.simulation_log import SimulationLog

AFTERWARDS = 2.0  # time for which the robot must stand after it is clear [s]
_CATCHING = 0.1  # time after the catch in which the force is that of the catch [s]
_LEFT = 0.03  # distance from the leaf at which a body that held it has left it [m]
_TOUCHES = 1.0  # mean over 20 ms of the force on the leaf above which something touches it [N]
_ROUNDING = 1e-6  # differences of times below this do not count [s]


@dataclass(frozen=True)
class WalkedThrough:
    """A walk through a door; times are on the log's axis.

    Attributes:
        begin: Time at which it begins [s].
        release: Time at which the hand lets the leaf go, as planned [s].
        steps: Number of its footsteps.
        angle: Planned angles of the leaf at all samples of the log; those from the begin to the
            release count, (n,) [rad].
        distances: Distances of the bodies from leaf, frame and doorway since the begin.
    """

    begin: float
    release: float
    steps: int
    angle: Array
    distances: BodyDistances


@dataclass(frozen=True)
class PassageRecord:
    """What was logged of a passage; times are on the log's axis.

    Attributes:
        log: The simulation's log.
        margin: ZMP margins at the log's samples, 20 ms means, (n,) [m].
        first_motion: Time of the robot's first motion [s].
        contact: Time of the first contact of the hit; NaN without one [s].
        peak: Time of the door's peak after it; NaN without one [s].
        walk: The walk; None if it did not begin.
    """

    log: SimulationLog
    margin: Array
    first_motion: float
    contact: float
    peak: float
    walk: WalkedThrough | None


def summary(run: PassageRecord, robot: RobotModel) -> dict[str, Any]:
    """Compute "passage" of `summary.json`; what is not known is NaN."""
    figures = {
        "passed": False, "time_s": math.nan, "hit_to_clear_s": math.nan, "steps": 0,
        "min_clearance_mm": math.nan, "hand_force_n": math.nan, "leaf_angle_error_deg": math.nan,
        "min_margin_mm": math.nan}
    walk, motion = run.walk, run.log.motion
    if walk is None:
        return figures
    since = clear(walk)
    held = (motion.t >= walk.begin - _ROUNDING) & (motion.t <= walk.release + _ROUNDING)
    off = np.abs(motion.door_angle - walk.angle)[held]
    margin = run.margin[(motion.t >= walk.begin - _ROUNDING) & np.isfinite(run.margin)]
    return figures | {
        "passed": passed(run),
        "time_s": since - run.first_motion,
        "hit_to_clear_s": since - run.contact,
        "steps": walk.steps,
        "min_clearance_mm": 1e3 * nearest(walk, robot)[0],
        "hand_force_n": hand_force(run, walk.release),
        "leaf_angle_error_deg": math.degrees(off.max()) if off.size else math.nan,
        "min_margin_mm": 1e3 * float(margin.min()) if margin.size else math.nan,
    }


def clear(walk: WalkedThrough) -> float:
    """Return when the robot is clear on the log's time axis [s]; NaN if it never is."""
    beyond = np.flatnonzero(walk.distances.beyond.min(axis=1) > 0.0)
    return float(walk.distances.time[beyond[0]]) if beyond.size else math.nan


def passed(run: PassageRecord) -> bool:
    """Return whether the robot passed the door and stands."""
    log = run.log
    if run.walk is None or not log.stood or log.frame_force.max() > 0.0:
        return False
    return float(log.motion.t[-1]) - clear(run.walk) >= AFTERWARDS - _ROUNDING  # not of a NaN


def nearest(walk: WalkedThrough, robot: RobotModel) -> tuple[float, str]:
    """Find the smallest distance of a body from frame and leaf in the walk and after it.

    Bodies that hold the leaf, which are those beyond the hitting arm's elbow, do not count up to
    the release, and after it until they have left the leaf by `_LEFT`.

    Returns:
        The distance [m], and the names of the body and of what it came near to.
    """
    found, holding = walk.distances, _holding(walk, robot)
    both = np.stack([np.where(holding, np.inf, each) for each in (found.leaf, found.frame)])
    which, row, body = np.unravel_index(int(both.argmin()), both.shape)
    return (float(both[which, row, body]),
            f"{found.links[int(body)]}, {('leaf', 'frame')[which]}")


def _holding(walk: WalkedThrough, robot: RobotModel) -> NDArray[np.bool_]:
    """Return which bodies may touch the leaf at the samples of the distances, (K, S)."""
    found, (forearm, hand) = walk.distances, holding_links(robot)
    beyond = np.isin(found.links, [*forearm, *hand])
    released = found.time > walk.release
    gone = np.maximum.accumulate(released[:, None] & (found.leaf > _LEFT), axis=0)
    return np.asarray(beyond & ~gone)


def hand_force(run: PassageRecord, release: float) -> float:
    """Compute the largest mean over 20 ms of the force on the leaf, from 100 ms after the catch.

    It is that of whichever body holds, up to the release; NaN if the leaf was not held [N].
    """
    force = _held_with(run, release)
    return float(force.max()) if force.size else math.nan


def contact_share(run: PassageRecord, release: float) -> float:
    """Compute the share of the time in which the force of `hand_force` is above `_TOUCHES`."""
    force = _held_with(run, release)
    return float((force > _TOUCHES).mean()) if force.size else math.nan


def _held_with(run: PassageRecord, release: float) -> Array:
    """Return the mean forces on the leaf from 100 ms after the catch up to the release, (n,)."""
    t, force = run.log.motion.t, run.log.motion.contact_force
    caught = next((float(t[each.start]) for each in evaluation.find_contacts(t, force)
                   if t[each.start] >= np.fmax(run.peak, run.first_motion)), math.nan)
    samples = max(1, round(evaluation.WINDOW / float(np.median(np.diff(t)))))
    mean = evaluation.centred_mean(force[:, None], samples)[:, 0]
    return np.asarray(mean[(t >= caught + _CATCHING) & (t <= release + _ROUNDING)])
