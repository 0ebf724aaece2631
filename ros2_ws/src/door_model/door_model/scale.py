"""What fixes the scale of an identification, which free motion leaves open.

With no external torque, one factor on I_A, c_c, k_c and tau'_c0 leaves eq. (1)'s motion as it is.
The leaf's mass and width, from a balance and a ruler, give I_A and with it the factor.
"""

import math
from dataclasses import dataclass

from door_model.checks import require_not_negative, require_positive
from door_model.errors import NoScaleError
from door_model.geometry import plate_moment_of_inertia

MASS_STD_SHARE = 0.005  # a balance's, over the mass
WIDTH_STD = 1e-3  # a ruler's [m]
_PLAUSIBLE = {"mass": (0.1, 5000.0), "width": (0.05, 10.0)}  # [kg], [m]


@dataclass(frozen=True)
class Scale:
    """Moment of inertia of the leaf with its standard deviation.

    Attributes:
        i_a: Moment of inertia about the hinge [kg m^2].
        std: Its standard deviation [kg m^2].
        reference: What it comes from, in words.
    """

    i_a: float
    std: float
    reference: str

    def __post_init__(self) -> None:
        """Check the numbers."""
        require_positive("i_a", self.i_a)
        require_not_negative("std of i_a", self.std)


def scale_from_leaf(
    mass: float | None,
    width: float | None,
    *,
    mass_std: float | None = None,
    width_std: float = WIDTH_STD,
) -> Scale:
    """Scale from the leaf's mass and width, I_A = m w^2 / 3.

    Args:
        mass: Mass [kg].
        width: Hinge to free edge [m].
        mass_std: Standard deviation of the mass [kg]; 0.5 % by default.
        width_std: Standard deviation of the width [m].

    Raises:
        NoScaleError: One is missing, not finite or not positive.
    """
    for name, value in (("mass", mass), ("width", width)):
        if value is None or not (math.isfinite(value) and value > 0.0):
            raise NoScaleError(
                f"the leaf's {name} is {'missing' if value is None else value}: free swings fix "
                "only the ratios of I_A, c_c, k_c and tau'_c0, so weigh the leaf [kg] and "
                "measure its width [m] from hinge to free edge",
                value=value,
                limit="a positive number",
            )
        low, high = _PLAUSIBLE[name]
        if not low <= value <= high:
            raise NoScaleError(
                f"the leaf's {name} of {value:g} is not plausible: {low:g} to {high:g}",
                value=value,
                limit=(low, high),
            )
    assert mass is not None
    assert width is not None
    mass_share = MASS_STD_SHARE if mass_std is None else mass_std / mass
    i_a = plate_moment_of_inertia(mass, width)
    std = i_a * math.hypot(mass_share, 2.0 * width_std / width)
    return Scale(i_a, std, f"I_A = m w^2 / 3 from a leaf of {mass:g} kg and {width:g} m")
