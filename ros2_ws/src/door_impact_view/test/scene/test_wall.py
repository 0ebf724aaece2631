"""Tests of the wall beside a door."""

import numpy as np
import pytest
from door_impact_view.scene.urdf import read_urdf
from door_impact_view.scene.wall import with_wall

DOOR = """<robot name="d"><link name="frame">
<visual><origin xyz="-0.05 -0.02 1"/><geometry><box size="0.1 0.04 2"/></geometry></visual>
<visual><origin xyz="0.95 -0.02 1"/><geometry><box size="0.1 0.04 2"/></geometry></visual>
</link>{}</robot>"""


def test_the_wall_begins_where_the_frame_ends():
    """Both pieces touch the frame's outer sides and have its height and thickness."""
    left, right = with_wall(read_urdf(DOOR.format(""))).shapes[2:]
    assert left.place[0] + 0.5 * left.size[0] == pytest.approx(-0.1)
    assert right.place[0] - 0.5 * right.size[0] == pytest.approx(1.0)
    for piece in (left, right):
        np.testing.assert_allclose(piece.place[1:], [-0.02, 1.0])
        np.testing.assert_allclose(piece.size[1:], [0.04, 2.0])
        assert piece.link == "frame"
