"""Wrenches of the surroundings on soles and hands, computed from the force sensors above them."""

from __future__ import annotations

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY

from hrp2_sim_bridge.physics.frames import cross, into_frame, rotation
from hrp2_sim_bridge.physics.states import BodyState


def outer_wrenches(
    reactions: Array, bodies: BodyState, duration: float, mass: Array, inertia: Array
) -> Array:
    """Compute force and torque of the surroundings on bodies beyond force sensors, in their frames.

    The sensor sits above the body, a sole or a hand, so its reading R, R_n does not contain the
    body's own weight and inertia: f = m (a - g) - R and n = I alpha + omega x I omega - R_n.

    Args:
        reactions: Mean force [N] and torque [N m] of the robot on each body, for T intervals and B
            bodies, (T, B, 6).
        bodies: States of the bodies at the ends of the intervals, (T + 1, B).
        duration: Duration of an interval [s].
        mass: Masses of the bodies, (B,) [kg].
        inertia: Principal moments of the bodies about their axes, (B, 3) [kg m^2].

    Returns:
        Force [N] and torque about the origin of the body's frame [N m], (T, B, 6). That on a sole
        points along +z when the robot stands.
    """
    turn = rotation(bodies.quaternion[1:])
    acceleration = (bodies.linear[1:] - bodies.linear[:-1]) / duration
    acceleration[..., 2] += GRAVITY
    alpha = into_frame(turn, (bodies.angular[1:] - bodies.angular[:-1]) / duration)
    omega = into_frame(turn, bodies.angular[1:])
    force = mass[:, None] * into_frame(turn, acceleration) - reactions[..., :3]
    torque = inertia * alpha + cross(omega, inertia * omega) - reactions[..., 3:]
    return np.concatenate([force, torque], axis=-1)
