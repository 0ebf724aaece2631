"""Rubber soles in PyBullet: rigid soles on an elastic foundation.

PyBullet's contact stiffness and damping make each contact point an implicit spring-damper. A sole
touches the floor with its four corners. With a stiffness k at each of them, its vertical stiffness
is 4 k, and its stiffness against rotation about x or y is 4 k times the square of half its width
or half its length.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from hrp2_description.robot import SoleRubber

_CORNERS = 4  # contact points of a sole on the floor


def lay_rubber(client: Any, body: int, soles: Iterable[int], rubber: SoleRubber) -> None:
    """Put rubber under soles.

    It must be there before the first contact with the floor: that contact would remain rigid.

    Args:
        client: Client of PyBullet.
        body: PyBullet's index of the robot.
        soles: PyBullet's indices of the links that stand on the floor.
        rubber: Stiffness and damping of the rubber under one sole.
    """
    for sole in soles:
        client.changeDynamics(
            body, sole,
            contactStiffness=rubber.stiffness / _CORNERS, contactDamping=rubber.damping / _CORNERS,
        )
