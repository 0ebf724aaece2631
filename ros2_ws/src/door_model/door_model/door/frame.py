r"""The fixed boxes around a leaf: wall, jamb, lintel and threshold.

The coordinates are those of `door_model.door.geometry.Leaf.center`: the hinge axis meets the floor
in the origin, x points along the closed leaf to its free edge, y towards the push side, and z up.
The leaf's face lies in y = 0; the leaf opens towards -y. So the wall extends from
`y = depth - wall_thickness` to `y = depth`, and the jambs are at `x = -g` and `x = width of the
leaf + g` with the gap `g = (width - width of the leaf) / 2`.

At the free edge this leaves room enough, because no point of the leaf gets farther in x than the
closed leaf's free edge. At the hinge it does not: the axis lies in the leaf's face, so the corner
behind it moves on a circle whose radius is the leaf's thickness t. The jamb there has a rebate, a
recess that is as deep as the corner comes. Seen from above, with the hinge at o::

    ################             ################   y = depth
    ####### wall ###|jamb        ##### wall #####
    ################|____ y = s  ################
    ############                 ################
    ############    o============################   y = 0
    ############    =============################   y = depth - wall_thickness
                    x = -g       x = leaf + g

The back of the leaf, open by an angle a of more than 90 deg, crosses the wall's far face at
`x = -t / sin(a) + (wall_thickness - depth) cot(a)`, and its corner comes to `y = -t cos(a)`. The
rebate leaves `FRAME_GAP` around both up to `CLEAR_ANGLE`; a leaf that opens farther would meet it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from door_model.door.geometry import (
    CLEAR_ANGLE,
    FLOOR_CLEARANCE,
    FRAME_GAP,
    Frame,
    Hinge,
    Leaf,
    along,
)

THRESHOLD = "threshold"  # name of the box on which feet may stand
_LINTEL_GAP = 0.01  # distance between leaf and lintel, our choice [m]
_WALL_LENGTH = 1.5  # length of the wall on each side of the opening, our choice [m]
_LINTEL_HEIGHT = 0.2  # height of the wall above the opening, our choice [m]
_THINNEST = 1e-4  # a thinner box is none: engines do not like slivers [m]
Triple = tuple[float, float, float]


@dataclass(frozen=True)
class FixedBox:
    """A box that does not move, with its edges along the axes.

    Attributes:
        name: Name of the part: wall_hinge_side, wall_free_side, jamb, lintel or threshold.
        center: Center, (3,) [m].
        size: Lengths of the edges, (3,) [m].
    """

    name: str
    center: Triple
    size: Triple

    @property
    def half(self) -> Triple:
        """Half lengths of the edges, (3,) [m]."""
        x, y, z = self.size
        return 0.5 * x, 0.5 * y, 0.5 * z


def frame_boxes(
    leaf: Leaf, frame: Frame, origin: Triple = (0.0, 0.0, 0.0), hinge: Hinge = "right"
) -> list[FixedBox]:
    """Return the boxes of a frame and of the wall around it.

    They touch each other, but do not overlap; one thinner than 0.1 mm is left out. A threshold
    that is as high as the leaf's distance from the floor, or higher, ends in front of the leaf,
    which closes behind it.

    Args:
        leaf: The leaf.
        frame: Its frame.
        origin: Point where the hinge axis meets the floor, (3,) [m].
        hinge: Side of the hinge; at the left x points away from the leaf.

    Raises:
        DoorParameterError: The leaf does not fit into the frame.
    """
    frame.require_around(leaf)
    gap = 0.5 * (frame.width - leaf.width)
    near, far = frame.depth, frame.depth - frame.wall_thickness
    # The rebate's gap is across the leaf.
    rebate = (leaf.thickness + FRAME_GAP) / math.sin(CLEAR_ANGLE) + far / math.tan(CLEAR_ANGLE)
    left, right, stop = -max(rebate, gap), leaf.width + gap, leaf.room_in_front()
    clear = leaf.top + _LINTEL_GAP
    top = clear + _LINTEL_HEIGHT
    begin = far if frame.threshold < FLOOR_CLEARANCE else stop
    limits = {
        "wall_hinge_side": ((left - _WALL_LENGTH, left), (far, near), (0.0, top)),
        "wall_free_side": ((right, right + _WALL_LENGTH), (far, near), (0.0, top)),
        "jamb": ((left, -gap), (stop, near), (0.0, clear)),
        "lintel": ((left, right), (far, near), (clear, top)),
        THRESHOLD: ((-gap, right), (begin, near), (0.0, frame.threshold)),
    }
    boxes = [_between(name, pairs, origin, along(hinge)) for name, pairs in limits.items()]
    return [box for box in boxes if min(box.size) >= _THINNEST]


def _between(
    name: str, limits: tuple[tuple[float, float], ...], origin: Triple, side: float
) -> FixedBox:
    """Return the box between limits (3, 2) from an origin (3,); wrong order: a negative size."""
    (x, y, z) = (
        start + 0.5 * sign * (low + high)
        for start, sign, (low, high) in zip(origin, (side, 1.0, 1.0), limits, strict=True))
    (a, b, c) = (high - low for low, high in limits)
    return FixedBox(name, (x, y, z), (a, b, c))
