"""What the feet must bear in the hit without slipping: that is what eq. (5) is for."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from door_impact_common.constants import GRAVITY
from humanoid_motion.errors import PostureUnreachable

from impact_planner.hit import momentum
from impact_planner.hit.hit_response import HitResponse
from impact_planner.hit.posture import HitPosture

LARGEST_SLIP = 0.002  # of the soles in the hit [m]


@dataclass(frozen=True)
class FloorLoad:
    """The floor's part in the hit, both feet together.

    Attributes:
        impulse: Horizontal impulse of the floor on the whole robot [N s].
        impulse_planar: The same of a rigid robot that turns about C and is hit on a smooth leaf: 0
            where eq. (5) holds [N s].
        yaw_impulse: Impulse of its moment about the vertical through the CoM [N m s].
        friction: Ratio of its horizontal to its vertical impulse over the contact.
        slip: Way of the soles, with the friction that they are taken to have [m].
    """

    impulse: float
    impulse_planar: float
    yaw_impulse: float
    friction: float
    slip: float


def floor_load(
    mass: float,
    posture: HitPosture,
    response: HitResponse,
    impulse: float,
    contact: float,
    available: float,
) -> FloorLoad:
    """What an impulse on the door asks of the floor.

    Where it asks for more friction than there is, what is missing sets the soles in motion; the
    mean speed of that is taken for the length of the contact.

    Args:
        mass: Of the robot [kg].
        posture: At the hit.
        response: What 1 N s does.
        impulse: Given to the door [N s].
        contact: Duration of the contact [s].
        available: Coefficient of friction of the soles.
    """
    planar = momentum.foot_impulse_planar(mass, posture.i_rob, posture.a_r, posture.b_r)
    horizontal = impulse * float(np.hypot(*response.floor[:2]))
    upright = mass * GRAVITY * contact + impulse * float(response.floor[2])
    friction = horizontal / upright if upright > 0.0 else math.inf
    missing = max(0.0, 1.0 - available / friction) if friction > 0.0 else 0.0
    slip = 0.5 * contact * missing * impulse * response.slide
    return FloorLoad(horizontal, impulse * planar, impulse * response.floor_yaw, friction, slip)


def require_no_slip(load: FloorLoad, available: float) -> None:
    """Check that the soles hardly slip in the hit.

    Raises:
        PostureUnreachable: They slip by more than `LARGEST_SLIP`.
    """
    if load.slip > LARGEST_SLIP:
        raise PostureUnreachable(
            f"the feet would slip by {1e3 * load.slip:.1f} mm in the hit: a friction of "
            f"{load.friction:.2f} is needed, the soles are taken to have {available:.2f}; "
            f"{1e3 * LARGEST_SLIP:g} mm are allowed",
            quantity="slip [m]", value=load.slip, limit=LARGEST_SLIP)


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
