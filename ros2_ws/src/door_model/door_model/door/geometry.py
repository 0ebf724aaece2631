"""What a balance and a ruler tell of a door, and nothing that an identification should find."""

from dataclasses import dataclass

from door_model.checks import require_positive
from door_model.door.closer import FourBarCloser

FLOOR_CLEARANCE = 0.01  # under every leaf [m], our choice


@dataclass(frozen=True)
class Leaf:
    """A door's leaf.

    Attributes:
        mass: Mass [kg].
        width: Hinge to free edge [m].
        height: Height [m].
        thickness: Thickness [m].

    Raises:
        DoorParameterError: One of them is not a positive number.
    """

    mass: float
    width: float
    height: float
    thickness: float

    def __post_init__(self) -> None:
        """Check the numbers."""
        for name in ("mass", "width", "height", "thickness"):
            require_positive(f"leaf {name}", getattr(self, name))

    def center(self) -> tuple[float, float, float]:
        """Center of the leaf [m], seen from where the hinge axis meets the floor.

        x points along the face to the free edge, -y into the door, z up; the face lies in y = 0.
        """
        return self.width / 2.0, -self.thickness / 2.0, FLOOR_CLEARANCE + self.height / 2.0

    def moment_of_inertia(self) -> float:
        """Moment of inertia about the hinge [kg m^2], see `plate_moment_of_inertia`."""
        return plate_moment_of_inertia(self.mass, self.width)


def plate_moment_of_inertia(mass: float, width: float) -> float:
    """Moment of inertia about its edge of a uniform thin plate [kg m^2]: m w^2 / 3.

    The paper's 47.62 kg and 12.75 kg m^2 agree with it at a width of 0.896 m.
    """
    require_positive("leaf mass", mass)
    require_positive("leaf width", width)
    return mass * width**2 / 3.0


@dataclass(frozen=True)
class DoorGeometry:
    """Leaf and linkage of a door: all that an identification is given.

    Attributes:
        name: Name of the door's configuration.
        leaf: The leaf.
        linkage: The closer's linkage.
    """

    name: str
    leaf: Leaf
    linkage: FourBarCloser
