"""Parameters of a door over its moment of inertia, on which its free motion depends."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True)
class Ratios:
    """Parameters over I_A; each a number or (K,), one for each door.

    Attributes:
        opening: c_c / I_A while the door opens [1/s].
        closing: While it closes [1/s].
        backcheck: While it opens beyond the angle of the backcheck [1/s].
        latch: While it closes below the angle of the latch zone [1/s].
        spring: k_c / I_A [1/s^2].
        preload: tau'_c0 / I_A [1/s^2].
        friction: Coulomb friction at the hinge over I_A [1/s^2].
        backcheck_angle: [rad]; infinite where there is none.
        latch_angle: [rad]; minus infinite where there is none.
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
        """All of them in this order, (9, count)."""
        rows = [np.broadcast_to(getattr(self, field.name), count) for field in fields(self)]
        return np.array(rows, dtype=float)
