"""Where a hit begins before a door, and how the door is seen from where the robot really stands.

A door's pose on the floor has its origin where the hinge axis meets the floor; x points along the
closed leaf to its free edge, y to the side from which the leaf is pushed. A hit begins where the
door is seen as surveyed. Hit and passage are planned in the axes of this place, which are along
the leaf. A walk never ends exactly there, so the hit is planned for the door as it is seen from the
soles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array

from walking.errors import BadDoorPose, NotReached
from walking.footsteps.footstep import ORIGIN, Pose

NEAR = (0.02, math.radians(1.0))
"""Distance [m] and turn [rad] from the start of a hit up to which nobody walks there."""
SURVEYED = (0.005, math.radians(0.3))
"""Distance [m] and turn [rad] up to which the robot stands as the door was surveyed."""
FARTHEST = 10.0  # longest way to a door [m]
ROOM = 0.45  # distance from the closed leaf in which the robot can turn [m]
FOUND = 0.013
"""Largest standard deviation of the leaf's distance: a touch finds it up to 40 mm off [m]."""


@dataclass(frozen=True)
class Site:
    """Where a hit begins.

    Attributes:
        axes: Pose in odom from which the door is seen as surveyed.
        soles: Middle between the soles in these axes.
        seen: Distance of the leaf's face at B from the soles, and of B from the hinge along the
            leaf [m]; negative: as surveyed.
        certain: Whether the survey says where the leaf is, so that it need not be touched.
    """

    axes: Pose = ORIGIN
    soles: Pose = ORIGIN
    seen: tuple[float, float] = (-1.0, -1.0)
    certain: bool = True


AS_SURVEYED = Site()
"""The place of a robot that stands where the door was surveyed from."""


def hit_start(door: Pose, survey: Pose) -> Pose:
    """Return where the middle between the soles is when a hit begins, in odom.

    Args:
        door: The door in odom.
        survey: The door as it is to be seen from there.
    """
    return door.moved(*ORIGIN.seen_from(survey))


def arrived(
    axes: Pose, middle: Pose, survey: Pose, ahead: float, *, certain: bool = False
) -> Site:
    """Return where a hit begins of a robot that has come there.

    Args:
        axes: Where it was to begin, in odom.
        middle: Middle between the soles in odom.
        survey: The door in these axes.
        ahead: Distance of B ahead of the soles, along their heading [m].
        certain: Whether the survey still says where the leaf is.

    Raises:
        NotReached: The robot stands elsewhere.
    """
    require_arrived(middle, axes)
    soles = middle.seen_from(axes)
    door = survey.seen_from(soles)
    along = ahead - door.x
    seen = -(door.y + along * math.tan(door.yaw)), along / math.cos(door.yaw)
    return Site(axes, soles, seen, certain)


def within(pose: Pose, other: Pose, limits: tuple[float, float]) -> bool:
    """Return whether two poses are within a distance [m] and a turn [rad] of each other."""
    x, y, yaw = pose.seen_from(other)
    return math.hypot(x, y) <= limits[0] and abs(yaw) <= limits[1]


def require_way(middle: Pose, start: Pose, door: Pose) -> None:
    """Check that the robot can walk straight to the start of a hit.

    Args:
        middle: Middle between the soles in odom.
        start: Where the hit begins in odom.
        door: The door in odom.

    Raises:
        BadDoorPose: That is too far away, or the robot is not on the side from which it pushes.
    """
    way, room = math.dist(middle[:2], start[:2]), middle.seen_from(door).y
    if not way <= FARTHEST:
        raise BadDoorPose(quantity="way to the start of the hit [m]", value=way,
                          limit=f"at most {FARTHEST:g}")
    if not room >= ROOM:
        raise BadDoorPose(quantity="distance of the robot from the closed leaf on its push side "
                          "[m]", value=room, limit=f"at least {ROOM:g}")


def require_arrived(middle: Pose, start: Pose) -> None:
    """Check that the robot stands where a hit begins; both are in odom.

    Raises:
        NotReached: It stands elsewhere.
    """
    if not within(middle, start, NEAR):
        x, y, yaw = middle.seen_from(start)
        off = math.hypot(x, y)
        raise NotReached(
            f"the robot stands {off:.3f} m and {math.degrees(yaw):.1f} deg from where the hit "
            f"begins, at most {NEAR[0]:g} m and {math.degrees(NEAR[1]):g} deg are allowed",
            quantity="soles [m]", value=off, limit=NEAR[0])


def require_found(covariance: Array, yaw: float, along: float) -> None:
    """Check that a touch can find the leaf.

    Args:
        covariance: Covariance of x, y [m] and yaw [rad] of the door along the axes of odom, (3, 3).
        yaw: Its yaw [rad].
        along: Distance from the hinge at which the leaf is touched [m].

    Raises:
        BadDoorPose: The leaf's distance there is too uncertain, or the covariance is none.
    """
    across = np.array([-math.sin(yaw), math.cos(yaw), along])
    variance = float(across @ covariance @ across)
    std = math.sqrt(variance) if variance >= 0.0 else math.nan
    if not std <= FOUND:
        raise BadDoorPose(quantity="standard deviation of the leaf's distance [m]", value=std,
                          limit=f"at most {FOUND:g}, with which a slow touch finds it")
