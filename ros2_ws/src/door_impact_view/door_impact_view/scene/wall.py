"""The wall in which a door stands, for the eye alone: no URDF describes it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from door_impact_view.scene.colors import WALL
from door_impact_view.scene.urdf import Shape, UrdfScene

_WIDTH = 0.8  # of the wall on each side of the door's frame [m]


def with_wall(door: UrdfScene) -> UrdfScene:
    """Return a door with a piece of wall on both sides of its frame, as shapes of its root link.

    The frame is what the boxes of the root link span; x is along the wall and z is up. The pieces
    are as thick and as high as the frame.

    Args:
        door: A door whose root link is its frame; without a box in it there is no wall.
    """
    boxes = [shape for shape in door.shapes if shape.link == door.root and shape.kind == "box"]
    if not boxes:
        return door
    half = 0.5 * np.array([shape.size for shape in boxes])
    middles = np.array([shape.place for shape in boxes])
    low, high = (middles - half).min(axis=0), (middles + half).max(axis=0)
    size = (_WIDTH, float(high[1] - low[1]), float(high[2] - low[2]))
    middle = 0.5 * (low + high)
    color = (*(value / 255.0 for value in WALL), 0.4)
    pieces = tuple(
        Shape(door.root, "box", size, np.array([x, middle[1], middle[2]]),
              np.array([1.0, 0.0, 0.0, 0.0]), (color[0], color[1], color[2], color[3]))
        for x in (low[0] - 0.5 * _WIDTH, high[0] + 0.5 * _WIDTH))
    return replace(door, shapes=(*door.shapes, *pieces))
