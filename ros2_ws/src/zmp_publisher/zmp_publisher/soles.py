"""Where a robot is in ``odom``, by the soles on which it stands.

`HeldSole` needs no IMU: the sole that bears more load lies flat and still on the floor. This takes
a sole on rubber, which tilts by some degrees while it bears the robot alone, for level.

`WeightedSoles` takes the tilt from the IMU, and place and heading from both soles. Every sole has
an anchor: where it stands on the floor. A sole that bears `FULL_SHARE` of the load or more keeps
its anchor; the anchor of a sole in the air follows the sole; in between the anchor follows the more
slowly, and counts the more, the more load the sole bears. So a foot that lands or leaves enters
gradually. Soles may tilt, and sink into their rubber. The gyro turns the heading, and the anchors
draw it back within `HEADING_TIME`: the gyro has no part in the give of the hips' yaw gears, the
anchors have none in the gyro's drift.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from humanoid_motion.kinematics import inverse_pose, planar_pose, yaw_of
from humanoid_motion.mirror import OTHER
from humanoid_motion.samples import ImuSample

HEADING_TIME = 0.5  # time constant with which the anchors correct the gyro's heading [s]
ANCHOR_TIME = 0.02  # time constant with which the anchor of a sole of weight 1/2 follows [s]
LEAST_SHARE = 0.05  # share of the load up to which a sole has no weight
FULL_SHARE = 0.3  # share of the load from which on a sole keeps its anchor
MOST_OFF = math.radians(3.0)  # largest give of the yaw gears between gyro and soles [rad]
LONGEST_GAP = 0.1  # time between readings beyond which the gyro is not integrated [s]


@dataclass(frozen=True)
class RobotPose:
    """Poses of base_link and of the soles in ``odom``.

    Attributes:
        base: Pose of base_link, (4, 4).
        soles: Poses of the ``left`` and ``right`` sole, (4, 4) each. Without an IMU a sole that
            bears load lies flat in z = 0.
        support: Side of the sole that bears most of the load.
    """

    base: Array
    soles: Mapping[str, Array]
    support: str


def next_support(
    support: str, loads: Mapping[str, float], loaded_force: float, take_over: float
) -> str:
    """Return the side of the sole that supports the robot from now on.

    Args:
        support: Side of the sole that supports it until now.
        loads: Normal force on each sole, not negative [N].
        loaded_force: Normal force that the other sole must at least bear [N].
        take_over: Share of the load that the other sole must at least bear.
    """
    other = OTHER[support]
    taken = loads[other] > max(loaded_force, take_over * sum(loads.values()))
    return other if taken else support


class HeldSole:
    """Follows a robot by the one sole that is assumed not to move.

    Args:
        loaded_force: Normal force above which a sole is assumed to lie on the floor [N].
        take_over: Share of the load above which the other sole becomes the held one.
    """

    def __init__(self, loaded_force: float, take_over: float) -> None:
        self._loaded_force = loaded_force
        self._take_over = take_over
        self._support = "left"
        self._anchor = np.eye(4)

    def begin(self, pose: RobotPose) -> None:
        """Continue from a pose."""
        self._support = pose.support
        self._anchor = _flattened(pose.soles[pose.support])

    def update(self, in_base: Mapping[str, Array], loads: Mapping[str, float]) -> RobotPose:
        """Compute the poses at the next sample.

        Args:
            in_base: Pose of each sole in base_link, (4, 4).
            loads: Normal force on each sole, not negative [N].
        """
        support = next_support(self._support, loads, self._loaded_force, self._take_over)
        if support != self._support:
            to_new = inverse_pose(in_base[self._support]) @ in_base[support]
            self._anchor = _flattened(self._anchor @ to_new)
            self._support = support
        base = self._anchor @ inverse_pose(in_base[support])
        other = OTHER[support]
        swing = base @ in_base[other]
        if loads[other] > self._loaded_force:
            swing = _flattened(swing)
        return RobotPose(base, {support: self._anchor.copy(), other: swing}, support)


class WeightedSoles:
    """Follows a robot by both soles and its IMU.

    Args:
        loaded_force: Normal force below which both soles together are taken to be in the air [N].
        take_over: Share of the load above which the other sole becomes the support.
        stiffness: Vertical stiffness of a sole's rubber [N/m]; infinite for a rigid sole.

    Attributes:
        doubt: Why the gyro is left out; empty while it is used.
    """

    def __init__(self, loaded_force: float, take_over: float, stiffness: float) -> None:
        self._loaded_force = loaded_force
        self._take_over = take_over
        self._stiffness = stiffness
        self._support = "left"
        self._anchors: dict[str, Array] = {}  # x [m], y [m] and heading [rad] of each sole
        self._weights: dict[str, float] = {}
        self.doubt = ""
        self._turn: Array | None = None  # rotation of the IMU in odom at the last reading, (3, 3)
        self._time = 0.0

    def begin(self, pose: RobotPose) -> None:
        """Continue from a pose; the heading then is that of the soles."""
        self._support = pose.support
        self._anchors = {side: _planar(sole) for side, sole in pose.soles.items()}
        self._weights = {side: float(side == pose.support) for side in pose.soles}
        self._turn = None

    def update(
        self,
        in_base: Mapping[str, Array],
        loads: Mapping[str, float],
        imu: ImuSample,
        imu_in_base: Array,
        time: float,
    ) -> RobotPose:
        """Compute the poses at the next sample.

        Args:
            in_base: Pose of each sole in base_link, (4, 4).
            loads: Normal force on each sole, not negative [N].
            imu: Reading of the IMU: a unit quaternion, whose heading is not used, and the
                angular velocity.
            imu_in_base: Rotation of the IMU in base_link, (3, 3).
            time: Time of the reading [s].
        """
        self._support = next_support(self._support, loads, self._loaded_force, self._take_over)
        elapsed = max(time - self._time, 0.0)
        total = sum(loads.values())
        in_air = not total > self._loaded_force
        now = self._weights if in_air else {side: _weight(loads[side] / total) for side in loads}
        # Where a sole was between two samples is not known, so the lesser weight counts: after a
        # gap, a sole that has landed has no place yet.
        weights = {side: min(now[side], before) for side, before in self._weights.items()}
        if not any(weights.values()):
            weights = self._weights
        parts = {side: weight / sum(weights.values()) for side, weight in weights.items()}

        turn = self._heading_by_gyro(imu, imu_in_base, elapsed)
        off = sum(
            part * _wrapped(self._anchors[side][2] - yaw_of(turn @ in_base[side][:3, :3]))
            for side, part in parts.items()
        )
        known = self._turn is not None and elapsed <= LONGEST_GAP
        if known and abs(off) > MOST_OFF:
            self.doubt = (
                f"the gyro's heading has left that of the soles by {math.degrees(abs(off)):.1f} "
                f"deg, at most {math.degrees(MOST_OFF):g} deg are possible: it is left out until "
                "the odometry begins anew (is the gyro in rad/s, and are its axes right?)")
        known = known and not self.doubt
        correction = -math.expm1(-elapsed / HEADING_TIME) if known else 1.0
        turn = _turn(off * correction) @ turn
        base = np.eye(4)
        base[:3, :3] = turn
        for side, part in parts.items():
            foothold = np.array([*self._anchors[side][:2], -loads[side] / self._stiffness])
            base[:3, 3] += part * (foothold - turn @ in_base[side][:3, 3])
        soles = {side: base @ pose for side, pose in in_base.items()}
        if not in_air:
            self._move_anchors(soles, weights, elapsed)
        self._turn, self._time, self._weights = turn @ imu_in_base, time, now
        return RobotPose(base, soles, self._support)

    def _heading_by_gyro(self, imu: ImuSample, in_base: Array, elapsed: float) -> Array:
        """Return the rotation of base_link in odom: the IMU's tilt, the gyro's heading, (3, 3).

        The headings are base_link's own, because an IMU may lie on its side and have none.
        """
        measured = imu.rotation @ in_base.T
        turned = np.eye(3)
        if self._turn is not None:
            rate = np.asarray(imu.angular_velocity, dtype=float)
            turned = self._turn @ pin.exp3(rate * elapsed) @ in_base.T
        return np.asarray(_turn(yaw_of(turned) - yaw_of(measured)) @ measured)

    def _move_anchors(
        self, soles: Mapping[str, Array], weights: Mapping[str, float], elapsed: float
    ) -> None:
        for side, weight in weights.items():
            if weight == 1.0:
                continue
            follow = elapsed / (elapsed + ANCHOR_TIME * weight / (1.0 - weight)) if weight else 1.0
            way = _planar(soles[side]) - self._anchors[side]
            way[2] = _wrapped(way[2])
            self._anchors[side] = self._anchors[side] + follow * way


def _weight(share: float) -> float:
    """Weight of a sole by its share of the load: 0 at `LEAST_SHARE`, 1 at `FULL_SHARE`, smooth."""
    ramp = min(max((share - LEAST_SHARE) / (FULL_SHARE - LEAST_SHARE), 0.0), 1.0)
    return ramp * ramp * (3.0 - 2.0 * ramp)


def _planar(pose: Array) -> Array:
    """x, y [m] and heading [rad] of a pose, (3,)."""
    return np.array([pose[0, 3], pose[1, 3], yaw_of(pose)])


def _wrapped(angle: float) -> float:
    return math.remainder(angle, math.tau)


def _turn(yaw: float) -> Array:
    return planar_pose(0.0, 0.0, yaw)[:3, :3]


def _flattened(pose: Array) -> Array:
    """Pose at the same x, y and heading, but flat in z = 0."""
    return planar_pose(pose[0, 3], pose[1, 3], yaw_of(pose))
