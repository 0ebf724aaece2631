"""Geometry and mass of a door, which are measured; the closer's parameters are identified."""

from dataclasses import dataclass

from door_impact_common.documents import Positive

from door_model.checks import require_positive, require_within
from door_model.door.closer import FourBarCloser

# Largest values of a leaf.
_LARGEST = {"mass": (2000.0, "kg (grams?)"), "width": (5.0, "m (mm?)"), "height": (6.0, "m (mm?)"),
            "thickness": (0.3, "m (mm?)")}
FLOOR_CLEARANCE = 0.01  # distance between floor and leaf, our assumption [m]


@dataclass(frozen=True)
class Leaf:
    """The leaf of a door.

    Attributes:
        mass: Mass of the leaf [kg].
        width: Distance from the hinge to the free edge [m].
        height: Height of the leaf [m].
        thickness: Thickness of the leaf [m].

    Raises:
        DoorParameterError: A value is not a positive number, or too large for a door.
    """

    mass: Positive
    width: Positive
    height: Positive
    thickness: Positive

    def __post_init__(self) -> None:
        """Check the numbers."""
        for name, (most, unit) in _LARGEST.items():
            require_within(f"leaf {name}", getattr(self, name), 0.0, most, unit)

    @property
    def top(self) -> float:
        """Height of the leaf's upper edge above the floor [m]."""
        return FLOOR_CLEARANCE + self.height

    def center(self) -> tuple[float, float, float]:
        """Return the center of the leaf [m], in the frame of the closed door.

        The origin is where the hinge axis meets the floor. x points along the leaf's face to the
        free edge, -y into the leaf, and z up; the face lies in y = 0.
        """
        return self.width / 2.0, -self.thickness / 2.0, FLOOR_CLEARANCE + self.height / 2.0

    def moment_of_inertia(self) -> float:
        """Return the moment of inertia of a uniform leaf about the hinge [kg m^2]."""
        return plate_moment_of_inertia(self.mass, self.width)


def plate_moment_of_inertia(mass: float, width: float) -> float:
    """Return the moment of inertia of a uniform thin plate about its edge, m w^2 / 3 [kg m^2].

    With the paper's mass m of 47.62 kg, a width w of 0.896 m gives the paper's 12.75 kg m^2.

    Args:
        mass: Mass m [kg].
        width: Width w, from the edge to the opposite edge [m].

    Raises:
        DoorParameterError: A value is not a positive number.
    """
    require_positive("leaf mass", mass)
    require_positive("leaf width", width)
    return mass * width**2 / 3.0


@dataclass(frozen=True)
class DoorGeometry:
    """Leaf and linkage of a door, which are the inputs of an identification.

    Attributes:
        name: Name of the door's configuration.
        leaf: The leaf.
        linkage: The closer's linkage.
    """

    name: str
    leaf: Leaf
    linkage: FourBarCloser
