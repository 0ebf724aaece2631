"""Parameters of a door divided by its moment of inertia, on which its free motion depends."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True)
class Ratios:
    """Parameters divided by I_A; each is a number, or an array (K,) with a value for each door.

    Attributes:
        opening: c_c / I_A while the door opens [1/s].
        closing: Viscosity over I_A while the door closes [1/s].
        backcheck: Viscosity over I_A while the door opens above backcheck_angle [1/s].
        latch: Viscosity over I_A while the door closes below latch_angle [1/s].
        spring: k_c / I_A [1/s^2].
        preload: tau'_c0 / I_A [1/s^2].
        friction: Coulomb friction at the hinge over I_A [1/s^2].
        backcheck_angle: Border of the backcheck [rad]; infinite if there is none.
        latch_angle: Border of the latch zone [rad]; minus infinity if there is none.
    """

    opening: ArrayLike
    closing: ArrayLike
    backcheck: ArrayLike
    latch: ArrayLike
    spring: ArrayLike
    preload: ArrayLike
    friction: ArrayLike = 0.0
    backcheck_angle: ArrayLike = np.inf
    latch_angle: ArrayLike = -np.inf

    def table(self, count: int) -> NDArray[np.float64]:
        """Return all ratios in this order, for a number of doors (9, count)."""
        rows = [np.broadcast_to(getattr(self, field.name), count) for field in fields(self)]
        return np.array(rows, dtype=float)
