"""What the feet must bear in the hit without slipping: that is what eq. (5) is for."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import momentum
from .errors import PostureUnreachable
from .robot_model import Blow, RobotModel
from .run_up import GRAVITY
from .stance import Stance

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FloorLoad:
    """The floor's part in the hit, both feet together.

    Attributes:
        impulse: Horizontal impulse of the floor, of the whole robot with free legs [N s].
        impulse_planar: The same of a rigid robot that turns about C: 0 where eq. (5) holds [N s].
        yaw_impulse: Impulse of its moment about the vertical through the CoM [N m s].
        friction: Largest ratio of its horizontal to its vertical force, with the impulses spread
            over the contact as half a sine.
    """

    impulse: float
    impulse_planar: float
    yaw_impulse: float
    friction: float


def floor_load(
    robot: RobotModel, stance: Stance, blow: Blow, impulse: float, contact: float
) -> FloorLoad:
    """What an impulse on the door asks of the floor.

    Args:
        robot: The robot.
        stance: Feet and posture at the hit.
        blow: What a blow on point B meets.
        impulse: Given to the door [N s].
        contact: Duration of the contact [s].
    """
    posture = stance.posture
    total, yaw = np.zeros(3), 0.0
    for side, each in blow.floor.items():
        arm = np.append(stance.feet[side][:2] - posture.com[:2], 0.0)
        total += impulse * each[:3]
        yaw += impulse * float(each[5] + np.cross(arm, each[:3])[2])
    planar = momentum.foot_impulse_planar(robot.mass, posture.i_rob, posture.a_r, posture.b_r)
    peak = 0.5 * math.pi / contact if contact > 0.0 else math.inf  # of half a sine of area 1 [1/s]
    horizontal = float(np.hypot(*total[:2]))
    upright = robot.mass * GRAVITY + min(0.0, peak * float(total[2]))
    friction = peak * horizontal / upright if upright > 0.0 else math.inf
    return FloorLoad(horizontal, impulse * planar, yaw, friction)


def require_grip(friction: float, available: float) -> None:
    """Check that the soles do not slip.

    Raises:
        PostureUnreachable: More friction is needed than there is.
    """
    if friction > available:
        raise PostureUnreachable(
            f"the feet would slip: a friction of {friction:.2f} is needed, the soles are taken to "
            f"have {available:.2f}",
            quantity="friction",
            value=friction,
            limit=available,
        )
