"""Posture at the hit, section II.C.4: the waist height that puts the center of percussion in C."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from . import momentum
from .errors import PostureUnreachable
from .robot_model import RobotModel
from .whole_body import solve

Array = NDArray[np.float64]

_STEP = 0.02  # between heights of the waist that are tried [m]


@dataclass(frozen=True)
class HitPosture:
    """The robot at the hit.

    Attributes:
        waist_height: Of base_link above the floor [m].
        joints: (30,) [rad].
        base: base_link in odom, (3,) [m].
        com: (3,) [m].
        elbow: Centre of the contact body in odom, (3,) [m].
        a_r: Height of B above the CoM [m].
        b_r: Height of the CoM above the floor [m].
        i_rob: Moment of inertia about the x axis through the CoM [kg m^2].
        b_r_percussion: Height of the CoM that eq. (5) asks for [m]; infinite for a_r <= 0.
    """

    waist_height: float
    joints: Array
    base: Array
    com: Array
    elbow: Array
    a_r: float
    b_r: float
    i_rob: float
    b_r_percussion: float

    @property
    def percussion_error(self) -> float:
        """How far the CoM is above the height that eq. (5) asks for [m]."""
        return self.b_r - self.b_r_percussion


def braced_upper_body(robot: RobotModel) -> Array:
    """Half-sitting with the right arm braced, (30,) [rad]."""
    return np.asarray(robot.config.posture(robot.config.braced_posture), dtype=float)


def posture_at(
    robot: RobotModel, waist_height: float, com_xy: Array, feet: dict[str, Array]
) -> HitPosture:
    """The braced robot with a given height of the waist and the CoM over a given point.

    Raises:
        PostureUnreachable: A leg does not reach.
    """
    joints, base = solve(
        robot,
        upper=braced_upper_body(robot),
        com_xy=com_xy,
        waist_z=waist_height,
        feet=feet,
    )
    return _figures(robot, waist_height, joints[0], base[0])


def _figures(robot: RobotModel, waist_height: float, joints: Array, base: Array) -> HitPosture:
    """What a posture means for the hit."""
    q = robot.configuration(base, joints)
    com, elbow = robot.com(q), robot.contact_position(q)
    i_rob = float(robot.inertia_about_com(q)[0, 0])
    a_r = float(elbow[2] - com[2])
    percussion = momentum.percussion_height(robot.mass, i_rob, a_r) if a_r > 0.0 else np.inf
    return HitPosture(
        waist_height=waist_height,
        joints=joints,
        base=base,
        com=com,
        elbow=elbow,
        a_r=a_r,
        b_r=float(com[2]),
        i_rob=i_rob,
        b_r_percussion=float(percussion),
    )


def percussion_posture(
    robot: RobotModel,
    com_xy: Array,
    feet: dict[str, Array],
    also: Sequence[Array] = (),
) -> tuple[HitPosture, float]:
    """The posture whose center of percussion lies on the floor, eq. (5).

    Args:
        robot: The robot.
        com_xy: CoM over the floor at the hit, (2,) [m].
        feet: Soles at the hit, (3,) each [m].
        also: Other places of the CoM that the legs must reach at the same height of the waist,
            as the motion goes through them, (2,) each [m].

    Returns:
        The posture, and by how much eq. (5) is missed [m]: 0, unless no height that the legs
        reach meets it; then the height that comes nearest.

    Raises:
        PostureUnreachable: No height of the waist is within reach.
    """
    found = [
        posture for posture in _reachable(robot, com_xy, feet, also)
        if np.isfinite(posture.percussion_error)
    ]
    if not found:
        right, (lowest, highest) = float(feet["right"][1]), robot.waist_heights()
        raise PostureUnreachable(
            f"no waist height from {lowest:.2f} to {highest:.2f} m keeps the legs within their "
            f"ranges with the right foot at y = {right:.3f} m",
            quantity="y of the right foot [m]",
            value=right,
            limit=(lowest, highest),
        )
    for lower, upper in itertools.pairwise(found):
        if lower.percussion_error * upper.percussion_error <= 0.0:
            height = brentq(
                lambda z: posture_at(robot, z, com_xy, feet).percussion_error,
                lower.waist_height,
                upper.waist_height,
                xtol=1e-6,
            )
            return posture_at(robot, float(height), com_xy, feet), 0.0
    nearest = min(found, key=lambda posture: abs(posture.percussion_error))
    return nearest, nearest.percussion_error


def _reachable(
    robot: RobotModel, com_xy: Array, feet: dict[str, Array], also: Sequence[Array]
) -> list[HitPosture]:
    """Postures whose legs reach every place of the CoM, by the height of the waist."""
    lowest, highest = robot.waist_heights()
    heights = np.arange(lowest, highest + 1e-9, _STEP)
    places = np.array([com_xy, *also], dtype=float)
    joints, base = solve(
        robot,
        upper=braced_upper_body(robot),
        com_xy=np.tile(places, (len(heights), 1)),
        waist_z=np.repeat(heights, len(places)),
        feet=feet,
        strict=False,
    )
    joints, base = (rows.reshape(len(heights), len(places), -1) for rows in (joints, base))
    inside = np.all((joints >= robot.lower) & (joints <= robot.upper), axis=(1, 2))  # no NaN is
    return [
        _figures(robot, float(height), rows[0], place[0])
        for height, rows, place, good in zip(heights, joints, base, inside, strict=True) if good
    ]
