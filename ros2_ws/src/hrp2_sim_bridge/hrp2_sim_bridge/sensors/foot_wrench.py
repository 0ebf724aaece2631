"""Wrenches of the floor on the soles, computed from the force sensors above the soles."""

from __future__ import annotations

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY

from hrp2_sim_bridge.physics.frames import cross, into_frame, rotation
from hrp2_sim_bridge.physics.states import BodyState


def foot_wrenches(
    reactions: Array, soles: BodyState, duration: float, mass: Array, inertia: Array
) -> Array:
    """Compute force and torque of the floor on each sole, in the sole's frame.

    The sensor sits above the sole, so its reading R, R_n does not contain the sole's own weight and
    inertia: f = m (a - g) - R and n = I alpha + omega x I omega - R_n.

    Args:
        reactions: Mean force [N] and torque [N m] of the ankle on the sole, for T intervals and F
            feet, (T, F, 6).
        soles: States of the soles at the ends of the intervals, (T + 1, F).
        duration: Duration of an interval [s].
        mass: Masses of the soles, (F,) [kg].
        inertia: Principal moments of the soles about their axes, (F, 3) [kg m^2].

    Returns:
        Force [N] and torque about the origin of the sole's frame [N m], (T, F, 6). The force points
        along +z when the robot stands.
    """
    turn = rotation(soles.quaternion[1:])
    acceleration = (soles.linear[1:] - soles.linear[:-1]) / duration
    acceleration[..., 2] += GRAVITY
    alpha = into_frame(turn, (soles.angular[1:] - soles.angular[:-1]) / duration)
    omega = into_frame(turn, soles.angular[1:])
    force = mass[:, None] * into_frame(turn, acceleration) - reactions[..., :3]
    torque = inertia * alpha + cross(omega, inertia * omega) - reactions[..., 3:]
    return np.concatenate([force, torque], axis=-1)
