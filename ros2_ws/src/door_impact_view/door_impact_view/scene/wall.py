"""Add the wall in which a door stands, for the eye alone: no URDF describes it."""

from __future__ import annotations

import copy

import numpy as np
import trimesh
from yourdfpy import Box, Color, Geometry, Material, Visual

from door_impact_view.scene.colors import WALL
from door_impact_view.scene.urdf import UrdfScene, scene_of

_WIDTH = 0.8  # of the wall on each side of the door's frame [m]
_OPACITY = 0.4


def with_wall(door: UrdfScene) -> UrdfScene:
    """Return a door with a piece of wall on both sides of its frame, as shapes of its root link.

    The frame is what the shapes of the root link span; x is along the wall and z is up. The pieces
    are as thick and as high as the frame.

    Args:
        door: A door whose root link is its frame; without a shape of it there is no wall.
    """
    frame = [shape.mesh.bounds for shape in door.shapes if shape.link == door.root]
    if not frame:
        return door
    low, high = np.min(frame, axis=(0, 1)), np.max(frame, axis=(0, 1))
    color = Material(color=Color(np.array([*(value / 255.0 for value in WALL), _OPACITY])))
    robot = copy.deepcopy(door.urdf.robot)
    root = next(link for link in robot.links if link.name == door.root)
    for x in (low[0] - 0.5 * _WIDTH, high[0] + 0.5 * _WIDTH):
        middle = trimesh.transformations.translation_matrix([x, *(0.5 * (low + high))[1:]])
        size = np.array([_WIDTH, *(high - low)[1:]])
        root.visuals.append(Visual(
            origin=middle, geometry=Geometry(box=Box(size)), material=color))
    return scene_of(robot)
