"""Geometry and mass of a door, which are measured; the closer's parameters are identified."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from door_impact_common.documents import NotNegative, Positive

from door_model.checks import require_positive, require_within
from door_model.door.closer import FourBarCloser
from door_model.errors import DoorParameterError

# Largest values of a leaf.
_LARGEST = {"mass": (2000.0, "kg (grams?)"), "width": (5.0, "m (mm?)"), "height": (6.0, "m (mm?)"),
            "thickness": (0.3, "m (mm?)")}
_THICKEST = 2.0  # wall [m]
FLOOR_CLEARANCE = 0.01  # distance between floor and leaf, our assumption [m]
CLEAR_ANGLE = math.radians(100.0)  # largest opening angle at which a frame leaves room [rad]
FRAME_GAP = 0.005  # least distance between a leaf that turns and its frame, our choice [m]
HIGHEST_THRESHOLD = 0.03  # highest threshold that a frame may have [m]
_DECIMALS = 9  # of a computed width [m]: rounding errors do not belong in a door's file

Hinge = Literal["right", "left"]
"""Side of the hinge for somebody who stands on the push side and faces the closed door."""


def along(hinge: str) -> float:
    """Return the sign of x in odom from a hinge to the closed leaf's free edge.

    All mathematics is that of a door hinged at the right; one hinged at the left is its mirror
    image in the plane x = 0 of odom. Both open towards -y, the right one about -z, the left one
    about z.
    """
    return 1.0 if hinge == "right" else -1.0


def before(hinge: str, pose: Sequence[float]) -> tuple[float, float, float]:
    """Return x [m], y [m] and heading [rad] in odom of what stands so before a hinge at the right.

    Before one at the left it is the mirror image.
    """
    x, y, heading = pose
    return (x, y, heading) if hinge == "right" else (-x, y, math.pi - heading)


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

    def room_in_front(self) -> float:
        """Return how deep in front of its face a frame must leave room at the hinge [m].

        The hinge axis lies in the face, so the corner behind it comes to `y = -t cos(a)` at an
        angle a of more than 90 deg, with the thickness t. The room is that of `CLEAR_ANGLE`.
        """
        return FRAME_GAP - self.thickness * math.cos(CLEAR_ANGLE)

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
class Frame:
    """The frame in which a leaf hangs, in a wall; `door_model.door.frame` returns its boxes.

    Attributes:
        width: Clear width between the jambs [m].
        depth: Distance from the wall's face on the push side to the face of the closed leaf [m].
        wall_thickness: Thickness of the wall [m].
        threshold: Height of the threshold [m]; 0 means that there is none.

    Raises:
        DoorParameterError: A number is not finite or out of its range.
    """

    width: Positive
    depth: NotNegative
    wall_thickness: Positive
    threshold: NotNegative = 0.0

    def __post_init__(self) -> None:
        """Check the numbers."""
        most, unit = _LARGEST["width"]
        require_within("frame width", self.width, 0.0, most, unit)
        require_within("frame wall_thickness", self.wall_thickness, 0.0, _THICKEST, unit)
        require_within("frame depth", self.depth, 0.0, self.wall_thickness,
                       "m, the wall's thickness", least=True)
        require_within("frame threshold", self.threshold, 0.0, HIGHEST_THRESHOLD, "m", least=True)

    def require_around(self, leaf: Leaf) -> None:
        """Check that a leaf fits between the jambs and above or behind the threshold.

        Raises:
            DoorParameterError: The leaf is wider, or would meet the threshold.
        """
        if self.width < leaf.width:
            raise DoorParameterError(
                "frame width", self.width, f"at least the leaf's width of {leaf.width:g} m")
        if self.threshold >= FLOOR_CLEARANCE and self.depth <= leaf.room_in_front():
            raise DoorParameterError(
                "frame threshold", self.threshold,
                f"below {FLOOR_CLEARANCE:g} m, where the leaf is, in a frame with a depth of "
                f"{self.depth:g} m: a higher one needs a depth above {leaf.room_in_front():.3g} m")


@dataclass(frozen=True)
class DoorGeometry:
    """Leaf and linkage of a door, which are the inputs of an identification, and its frame.

    Attributes:
        name: Name of the door's configuration.
        leaf: The leaf.
        linkage: The closer's linkage.
        frame: The frame; None if it is not known.
        hinge: Side of the hinge.
    """

    name: str
    leaf: Leaf
    linkage: FourBarCloser
    frame: Frame | None = None
    hinge: Hinge = "right"

    def with_leaf(self, leaf: Leaf) -> "DoorGeometry":
        """Return the geometry with another leaf; the frame keeps the gaps beside the leaf."""
        frame = self.frame
        if frame is not None:
            width = max(round(frame.width - self.leaf.width + leaf.width, _DECIMALS), leaf.width)
            frame = replace(frame, width=width)
        return replace(self, leaf=leaf, frame=frame)
