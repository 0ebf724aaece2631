"""The share of the floor's load that each foot is to bear, in the axes of its own sole."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array


@dataclass(frozen=True)
class FootLoads:
    """Wanted loads of the feet; rows are the left and the right foot.

    Attributes:
        force: Normal forces, (2,) [N].
        moment: Moments about the x and y axes of each sole through its middle, (2, 2) [N m].
        pivot: x and y of the point between the soles about which the body tilts, in the level
            frame, (2,) [m].
        beyond: Distance of the wanted ZMP from the one that the soles bear [m].
    """

    force: Array
    moment: Array
    pivot: Array
    beyond: float


@dataclass(frozen=True)
class Soles:
    """Where soles are in the level frame, and which of them are on the floor.

    Attributes:
        centers: x and y of the middles of the left and the right sole, (2, 2) [m].
        turns: Rotation matrices (2, 2, 2) of the soles about the vertical.
        standing: Whether each sole is on the floor; at least one must be.
    """

    centers: Array
    turns: Array
    standing: Sequence[bool]


def share_load(
    zmp: Array, normal_force: float, soles: Soles, reach: Array, inset: float
) -> FootLoads:
    """Distribute a ZMP between the feet: forces by its position, ankle moments for the rest.

    Both ankles are asked for the same distance between the force and the middle of the sole, each
    up to the edge of its own, turned sole.

    Args:
        zmp: x and y of the wanted ZMP in the level frame, (2,) [m].
        normal_force: Normal force on both soles together [N].
        soles: Places of the soles.
        reach: Largest distance of the ZMP from a sole's middle along the sole's x and y, (2,) [m].
        inset: Distance of the ZMP from a sole's middle at which this sole alone bears it [m].
    """
    centers = soles.centers
    if all(soles.standing):
        line = centers[0] - centers[1]
        length = math.hypot(line[0], line[1])
        along = float((zmp - centers[1]).dot(line)) / length
        left = min(max((along - inset) / (length - 2.0 * inset), 0.0), 1.0)
    else:
        left = 1.0 if soles.standing[0] else 0.0
    share = np.array([left, 1.0 - left])
    pivot = share.dot(centers)
    arms = (zmp - pivot).dot(soles.turns)  # in the axes of each sole, (2, 2)
    reached = arms.clip(-reach, reach)
    force = share * normal_force
    moment = force[:, None] * np.column_stack([reached[:, 1], -reached[:, 0]])
    missing = share.dot(np.einsum("fij,fj->fi", soles.turns, arms - reached))
    return FootLoads(force, moment, pivot, max(np.abs(missing).tolist()))
