"""Evaluate a run from the simulation's 1 kHz log; here are the definitions of `summary.json`."""

import math
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY
from hrp2_description.robot import SIDES, RobotConfig
from hrp2_description.support import polygon_margin, sole_corners, support_polygon
from humanoid_motion.zmp import zmp_of

from door_impact_evaluation.errors import DemoError
from door_impact_evaluation.run.record import Motion, Support

_SWINGS = 0.01  # time after the contact over which the speed of B is averaged [s]
CONTACT_FORCE = 5.0   # normal force above which robot and door are in contact [N]
CONTACT_GAP = 0.02    # time without contact after which the next one counts as another [s]
BEARS_WEIGHT = 0.05   # share of the load above which a sole belongs to the support polygon
WINDOW = 0.02         # length of the centred mean of the wrenches [s]
_LEAST_LOAD = 0.2     # share of the weight on the feet below which there is no ZMP


@dataclass(frozen=True)
class Contact:
    """One contact of robot and door.

    Attributes:
        start: Index of its first sample in the log.
        end: Index of the first sample after it.
    """

    start: int
    end: int


@dataclass(frozen=True)
class Impact:
    """The hit, measured in the simulation's log.

    Attributes:
        contact: First contact of robot and door.
        contacts_before_peak: Number of contacts up to the door's largest angle.
        peak: Index of the door's largest angle in the log.
        v_rb: Speed of point B towards the door just before the contact [m/s].
        v_rb_post: Speed of point B towards the door after the contact, a mean over 10 ms, because
            the elbow swings on the gears of the arm [m/s].
        omega_door: Angular velocity of the door just after the contact [rad/s].
        peak_force: Largest normal force in the contact [N].
        duration: Duration of the contact [s].
        restitution: Speed of separation over speed of approach.
    """

    contact: Contact
    contacts_before_peak: int
    peak: int
    v_rb: float
    v_rb_post: float
    omega_door: float
    peak_force: float
    duration: float
    restitution: float


def find_contacts(t: Array, force: Array) -> list[Contact]:
    """Find the contacts: the force is above 5 N, and 20 ms without it separate two contacts.

    Args:
        t: Sample times (n,) [s].
        force: Normal force of the robot on the door (n,) [N].
    """
    touching = np.flatnonzero(force > CONTACT_FORCE)
    if touching.size == 0:
        return []
    breaks = np.flatnonzero(np.diff(t[touching]) > CONTACT_GAP)
    starts = touching[np.concatenate([[0], breaks + 1])]
    ends = touching[np.concatenate([breaks, [touching.size - 1]])] + 1
    return [Contact(int(s), int(e)) for s, e in zip(starts, ends, strict=True)]


def impact(motion: Motion, l_b: float, since: float = -math.inf) -> Impact:
    """Evaluate the hit, the first contact of robot and door in the run-up.

    Args:
        motion: The simulation's log.
        l_b: Distance of point B from the hinge [m].
        since: Start of the run-up [s]; a probe touches the door before it.

    Raises:
        DemoError: The robot did not hit the door.
    """
    contacts = [each for each in find_contacts(motion.t, motion.contact_force)
                if motion.t[each.start] >= since]
    if not contacts:
        raise DemoError("the robot did not hit the door")
    first = contacts[0]
    # The door has opened when it first falls back; what the hand does to it later does not count.
    falling = np.flatnonzero(motion.door_velocity[first.end:] <= 0.0)
    peak = first.end + int(falling[0]) if falling.size else len(motion.t) - 1
    before, after = max(first.start - 1, 0), min(first.end, len(motion.t) - 1)
    swinging = motion.t[after:] < motion.t[after] + _SWINGS
    v_rb = motion.point_b_velocity[before]
    v_post = motion.point_b_velocity[after:][swinging].mean()
    omega = motion.door_velocity[after]
    return Impact(
        contact=first,
        contacts_before_peak=sum(c.start < peak for c in contacts),
        peak=peak,
        v_rb=float(v_rb),
        v_rb_post=float(v_post),
        omega_door=float(omega),
        peak_force=float(motion.contact_force[first.start:first.end].max()),
        duration=float(motion.t[after] - motion.t[first.start]),
        restitution=float((omega * l_b - v_post) / v_rb),
    )


def centred_mean(values: Array, samples: int) -> Array:
    """Average over a centred window along the first axis; at both ends the window is shorter.

    Args:
        values: Samples (n, k).
        samples: Length of the window.

    Returns:
        Means (n, k).
    """
    half = samples // 2
    total = np.vstack([np.zeros_like(values[:1]), np.cumsum(values, axis=0)])
    n = len(values)
    low = np.maximum(np.arange(n) - half, 0)
    high = np.minimum(np.arange(n) + half + 1, n)
    mean: Array = (total[high] - total[low]) / (high - low)[:, None]
    return mean


def support(motion: Motion, robot: RobotConfig, *, window: float) -> Support:
    """Compute the ZMP from the wrenches on the feet, the support polygon and the ZMP's margin.

    Args:
        motion: The simulation's log.
        robot: The robot, for its mass and its soles.
        window: Length of the centred mean of the wrenches [s]; 0 takes each sample as it is.
    """
    samples = max(1, round(window / float(np.median(np.diff(motion.t)))))
    wrenches = [centred_mean(w, samples) if samples > 1 else w
                for w in (motion.left_wrench, motion.right_wrench)]
    soles = (motion.left_sole, motion.right_sole)
    load = np.stack([np.maximum(w[:, 2], 0.0) for w in wrenches])
    total = load.sum(axis=0)
    # A foot that stands has one heading, and one polygon for each rounded place.
    turns = [np.round(turn, 3) for turn in (motion.left_heading, motion.right_heading)]
    # Soles lie level in z = 0, so only normal forces have levers about odom's horizontal axes.
    zero = np.zeros_like(total)
    force = np.stack([zero, zero, total], axis=1)
    moment = np.sum([
        np.stack([np.cos(a) * w[:, 3] - np.sin(a) * w[:, 4] + s[:, 1] * w[:, 2],
                  np.sin(a) * w[:, 3] + np.cos(a) * w[:, 4] - s[:, 0] * w[:, 2], zero], axis=1)
        for s, a, w in zip(soles, turns, wrenches, strict=True)], axis=0)
    loaded = total > _LEAST_LOAD * robot.mass * GRAVITY
    zmp = np.where(loaded[:, None], zmp_of(force, moment), np.nan)
    bears = load > BEARS_WEIGHT * total
    margin, low, high = (np.full(len(total), np.nan) for _ in range(3))
    # The feet stand still most of the time: one polygon is made for each pair of places, rounded
    # to 0.1 mm and 1 mrad, and not one for each sample. Where a swinging foot is does not matter.
    place = np.hstack([
        np.where(bear[:, None], np.column_stack([np.round(s[:, :2], 4), a]), 0.0)
        for s, a, bear in zip(soles, turns, bears, strict=True)] + [bears.T])
    places, index = np.unique(place, axis=0, return_inverse=True)
    index = index.reshape(-1)
    polygons = [np.empty((0, 2))]
    polygon = np.zeros(len(total), dtype=np.intp)
    for number, row in enumerate(places):
        here = index == number
        corners = [sole_corners(robot.soles[side], row[3 * k:3 * k + 3])
                   for k, side in enumerate(SIDES) if row[6 + k]]
        if not corners:
            continue
        hull = support_polygon(*corners)
        polygon[here] = len(polygons)
        polygons.append(hull)
        margin[here] = polygon_margin(zmp[here], hull)
        low[here], high[here] = (-hull[:, 1]).min(), (-hull[:, 1]).max()
    return Support(zmp, margin, low, high, polygons, polygon)


def smallest_margins(t: Array, margin: Array, phases: dict[str, tuple[float, float]],
                     ) -> dict[str, float]:
    """Find the smallest ZMP margin of each phase [m].

    Args:
        t: Sample times (n,) [s].
        margin: ZMP margins (n,) [m].
        phases: Start and end of each phase [s]; a phase without a sample is left out.
    """
    return {name: float(np.nanmin(margin[(t >= start) & (t < end)]))
            for name, (start, end) in phases.items() if ((t >= start) & (t < end)).any()}


def heading(orientation: Array) -> Array:
    """Compute the turn about the vertical (n,) [rad], without jumps of whole turns.

    Args:
        orientation: Orientations in odom, quaternions x, y, z, w (n, 4).
    """
    x, y, z, w = orientation.T
    return np.unwrap(np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y**2 + z**2)))


def tilt(orientation: Array) -> Array:
    """Compute the angle between base_link's z axis and the vertical (n,) [rad].

    Args:
        orientation: Orientation of base_link in odom, quaternions x, y, z, w (n, 4).
    """
    x, y = orientation[:, 0], orientation[:, 1]
    return np.arccos(np.clip(1.0 - 2.0 * (x**2 + y**2), -1.0, 1.0))


def slip(motion: Motion, start: float, end: float) -> float:
    """Compute the largest distance that a sole moved over the floor [m].

    Args:
        motion: The simulation's log.
        start: Time from which the distance is measured [s].
        end: Time until which the distance is measured [s].
    """
    window = (motion.t >= start) & (motion.t < end)
    return max(float(np.linalg.norm(s[window][:, :2] - s[window][0, :2], axis=1).max())
               for s in (motion.left_sole, motion.right_sole))
