"""Zero-moment point (ZMP) and its margin from the wrenches under the feet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.errors import SettingError
from hrp2_description.support import polygon_margin, sole_corners, support_polygon
from humanoid_motion.zmp import zmp_of
from numpy.typing import ArrayLike
from robot_driver.foot_doubts import lifted, lying

Rect = tuple[float, float, float, float]


def wrench_in_world(wrench: ArrayLike, pose: ArrayLike) -> Array:
    """Transform a wrench from a frame to the world.

    Args:
        wrench: Force and torque in the frame, about the frame's origin, (..., 6) [N, N m].
        pose: Pose of the frame in the world, (..., 4, 4).

    Returns:
        Force and torque in the world, about the world's origin, (..., 6) [N, N m].
    """
    given = np.asarray(wrench, dtype=float)
    placed = np.asarray(pose, dtype=float)
    turn = placed[..., :3, :3]
    force = (turn @ given[..., :3, None])[..., 0]
    torque = (turn @ given[..., 3:, None])[..., 0]
    (x, y, z), (fx, fy, fz) = np.moveaxis(placed[..., :3, 3], -1, 0), np.moveaxis(force, -1, 0)
    lever = np.stack([y * fz - z * fy, z * fx - x * fz, x * fy - y * fx], axis=-1)
    return np.concatenate([force, torque + lever], axis=-1)


@dataclass(frozen=True)
class ZmpReading:
    """The ZMP of one sample and its distance from the edge of the support polygon.

    Attributes:
        point: x and y of the ZMP on the floor, in the world, (2,) [m].
        normal_force: Normal force of the floor on both soles [N].
        soles: Corners of each sole that forms the support polygon, by side, in the world.
    """

    point: Array
    normal_force: float
    soles: Mapping[str, Array]

    @property
    def loaded(self) -> tuple[str, ...]:
        """Sides of the soles that form the support polygon."""
        return tuple(self.soles)

    @cached_property
    def polygon(self) -> Array:
        """Corners of the support polygon, counter-clockwise, in the world, (M, 2) [m]."""
        return support_polygon(*self.soles.values())

    @cached_property
    def margin(self) -> float:
        """Distance from the ZMP to the nearest edge, positive inside, negative outside [m]."""
        return float(polygon_margin(self.point, self.polygon))


class ZmpEstimator:
    """ZMP and margin of a robot that stands on one or two soles.

    Args:
        weight: Weight of the robot [N].
        soles: Support area (x_min, x_max, y_min, y_max) of the ``left`` and ``right`` sole, in the
            sole's frame [m].
        threshold: Share of the weight below which there is no reading.
        support_share: Share of the weight above which a sole counts as support.

    Raises:
        SettingError: A setting is out of its range.
    """

    def __init__(
        self,
        weight: float,
        soles: Mapping[str, Rect],
        *,
        threshold: float = 0.2,
        support_share: float = 0.05,
    ) -> None:
        if not (np.isfinite(weight) and weight > 0.0):
            raise SettingError("weight", weight, "positive")
        if not 0.0 < support_share < 0.5:
            raise SettingError("support_share", support_share, "in (0, 0.5)")
        # Below twice the support share possibly no sole counts, and there is no polygon.
        if not 2.0 * support_share <= threshold <= 1.0:
            raise SettingError("threshold", threshold, f"in [{2.0 * support_share:g}, 1]")
        self._soles = dict(soles)
        self._least_total = threshold * weight
        self._least_sole = support_share * weight

    def read(
        self, poses: Mapping[str, Array], wrenches: Mapping[str, ArrayLike]
    ) -> ZmpReading | None:
        """Compute the reading of one sample; a sole that is lifted bears nothing.

        Args:
            poses: Pose of each sole in the world, by side, (4, 4).
            wrenches: Force and torque of the floor on each sole, by side, in the sole's frame about
                its origin, (6,) [N, N m].

        Returns:
            The reading; None if the feet bear less than the threshold or a wrench is not finite.
        """
        parts = {side: wrench_in_world(wrenches[side], poses[side]) for side in self._soles}
        if air := lying(lifted(poses), {side: part[2] for side, part in parts.items()}):
            parts[air] = np.zeros(6)
        total = np.sum(list(parts.values()), axis=0)
        if not (np.isfinite(total).all() and total[2] >= self._least_total):
            return None
        soles = {side: sole_corners(rect, poses[side]) for side, rect in self._soles.items()
                 if parts[side][2] > self._least_sole}
        return ZmpReading(zmp_of(total[:3], total[3:]), float(total[2]), soles)
