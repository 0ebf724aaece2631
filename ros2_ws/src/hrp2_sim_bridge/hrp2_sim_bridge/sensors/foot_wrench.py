"""Wrenches of the floor on the soles from the sensors above them."""

from __future__ import annotations

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY

from hrp2_sim_bridge.physics.frames import BodyState, cross, into_frame, rotation


def foot_wrenches(
    reactions: Array, soles: BodyState, duration: float, mass: Array, inertia: Array
) -> Array:
    """Force and torque of the floor on each sole, in the sole's frame.

    The sensor sits above the sole: its reading R leaves out the sole's weight and inertia, so
    f = m (a - g) - R and n = I alpha + omega x I omega - R_n.

    Args:
        reactions: (T, F, 6) mean readings of F feet over T intervals, [N] and [N m]: what the ankle
            exerts on the sole.
        soles: (T + 1, F) states at the intervals' ends.
        duration: of an interval [s].
        mass: (F,) of the soles [kg].
        inertia: (F, 3) their principal moments, about the soles' axes [kg m^2].

    Returns:
        (T, F, 6) force [N] and torque about the sole frame's origin [N m]; +z when standing.
    """
    turn = rotation(soles.quaternion[1:])
    acceleration = (soles.linear[1:] - soles.linear[:-1]) / duration
    acceleration[..., 2] += GRAVITY
    alpha = into_frame(turn, (soles.angular[1:] - soles.angular[:-1]) / duration)
    omega = into_frame(turn, soles.angular[1:])
    force = mass[:, None] * into_frame(turn, acceleration) - reactions[..., :3]
    torque = inertia * alpha + cross(omega, inertia * omega) - reactions[..., 3:]
    return np.concatenate([force, torque], axis=-1)
