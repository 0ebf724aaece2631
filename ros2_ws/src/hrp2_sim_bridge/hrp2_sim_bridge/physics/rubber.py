"""Soles of rubber in PyBullet: rigid soles on an elastic foundation.

PyBullet's contact stiffness and damping make each contact point an implicit spring-damper. A sole
on the floor has four, its corners, so it feels k_z = 4 k, and about x and y 4 k times the square
of half its width or length.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from hrp2_description.robot import SoleRubber

_CORNERS = 4


def lay_rubber(client: Any, body: int, soles: Iterable[int], rubber: SoleRubber) -> None:
    """Put rubber under soles; before their first contact, which would stay rigid.

    Args:
        client: of PyBullet.
        body: the robot.
        soles: its links that stand on the floor.
        rubber: under each of them.
    """
    for sole in soles:
        client.changeDynamics(
            body, sole,
            contactStiffness=rubber.stiffness / _CORNERS, contactDamping=rubber.damping / _CORNERS,
        )
