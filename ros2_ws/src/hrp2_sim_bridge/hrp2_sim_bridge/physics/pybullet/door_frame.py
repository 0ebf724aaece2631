"""The door's frame and the wall around it in PyBullet."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from door_model.door.frame import THRESHOLD, FixedBox

from hrp2_sim_bridge.physics.pybullet.leaf import HINGE

_PLASTER = (0.88, 0.88, 0.86, 0.5)  # one sees what happens behind the wall


class FrameBodies:
    """Boxes that do not move; only the robot meets them.

    Args:
        client: Client of PyBullet.
        boxes: The boxes in the world.
        leaf: PyBullet's index of the leaf, which the boxes let pass.
        friction: Coefficient of friction between robot and wall.
        floor_friction: Coefficient of friction between soles and threshold.

    Attributes:
        walls: PyBullet's indices of all boxes but the threshold.
        thresholds: PyBullet's index of the threshold; empty where there is none.
    """

    def __init__(
        self, client: Any, boxes: Sequence[FixedBox], leaf: int, friction: float,
        floor_friction: float,
    ) -> None:
        self.walls: list[int] = []
        self.thresholds: list[int] = []
        for box in boxes:
            low = box.name == THRESHOLD
            shape = client.createCollisionShape(client.GEOM_BOX, halfExtents=box.half)
            picture = client.createVisualShape(
                client.GEOM_BOX, halfExtents=box.half, rgbaColor=_PLASTER)
            body = client.createMultiBody(
                baseMass=0.0, baseCollisionShapeIndex=shape, baseVisualShapeIndex=picture,
                basePosition=box.center)
            # PyBullet multiplies the friction of the two bodies; the box has that of the pair.
            client.changeDynamics(
                body, -1, lateralFriction=floor_friction if low else friction, restitution=0.0)
            client.setCollisionFilterPair(body, leaf, -1, HINGE, 0)
            (self.thresholds if low else self.walls).append(body)
