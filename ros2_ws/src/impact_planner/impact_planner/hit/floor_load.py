"""Load of the hit on the feet, which eq. (5) is to keep small, and the check against slip."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from door_impact_common.constants import GRAVITY
from humanoid_motion.errors import PostureUnreachable

from impact_planner.hit import momentum
from impact_planner.hit.hit_response import HitResponse
from impact_planner.hit.posture import HitPosture

LARGEST_SLIP = 0.002  # largest allowed slip of the soles in the hit [m]


@dataclass(frozen=True)
class FloorLoad:
    """Load of the floor on both feet together in the hit.

    Attributes:
        impulse: Horizontal impulse of the floor on the robot [N s].
        impulse_planar: Horizontal impulse of the floor on a rigid robot that turns about C and
            hits a smooth leaf; 0 where eq. (5) holds [N s].
        yaw_impulse: Impulse of the floor's moment about the vertical through the CoM [N m s].
        friction: Ratio of the floor's horizontal to its vertical impulse during the contact.
        slip: Distance that the soles slip with the assumed friction [m].
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
    available: float,
) -> FloorLoad:
    """Compute the load of a hit on the floor.

    Where the hit needs more friction than the soles have, the missing impulse accelerates the
    soles. Their slip is the mean speed of this motion times the duration of the contact.

    Args:
        mass: Mass of the robot [kg].
        response: The hit as the model has it.
        impulse: Impulse given to the door, which differs from the model's where hits have taught
            another effective mass [N s].
        available: Coefficient of friction of the soles.
    """
    planar = momentum.foot_impulse_planar(mass, posture.i_rob, posture.a_r, posture.b_r)
    scale, contact = impulse / response.impulse, response.duration
    horizontal = scale * float(np.hypot(*response.floor[:2]))
    upright = mass * GRAVITY * contact + scale * float(response.floor[2])
    friction = horizontal / upright if upright > 0.0 else math.inf
    missing = max(0.0, 1.0 - available / friction) if friction > 0.0 else 0.0
    slip = 0.5 * contact * missing * horizontal * response.slide
    return FloorLoad(horizontal, impulse * planar, scale * response.floor_yaw, friction, slip)


def require_no_slip(load: FloorLoad, available: float) -> None:
    """Check that the soles slip by at most `LARGEST_SLIP` in the hit.

    Args:
        load: Load of the hit on the feet.
        available: Coefficient of friction of the soles, for the message.

    Raises:
        PostureUnreachable: The soles slip further.
    """
    if load.slip > LARGEST_SLIP:
        raise PostureUnreachable(
            f"the feet would slip by {1e3 * load.slip:.1f} mm in the hit, {1e3 * LARGEST_SLIP:g} "
            f"mm are allowed: it needs a friction of {load.friction:.2f}, sole_friction is "
            f"{available:.2f}; request a smaller angle",
            quantity="slip [m]", value=load.slip, limit=LARGEST_SLIP)


def require_grip(friction: float, available: float) -> None:
    """Check that the soles do not slip outside the hit.

    Args:
        friction: Coefficient of friction that the motion needs.
        available: Coefficient of friction of the soles.

    Raises:
        PostureUnreachable: The motion needs more friction than is available.
    """
    if friction > available:
        raise PostureUnreachable(
            f"the feet would slip: the motion needs a friction of {friction:.2f}, sole_friction "
            f"is {available:.2f}; request a smaller angle",
            quantity="friction",
            value=friction,
            limit=available,
        )
