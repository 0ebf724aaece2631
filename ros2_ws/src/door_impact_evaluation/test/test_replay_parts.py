"""Parts of a replay: polygons, planned margins, and places to look from."""

import numpy as np
import pytest
from door_impact_evaluation.report import replay_parts as parts
from door_impact_view.replay.recording import Curve, Phase, Tree
from door_impact_view.scene.poses import IDENTITY, axis_angle
from door_impact_view.scene.urdf import read_urdf
from hypothesis import given
from hypothesis import strategies as st

DOOR = read_urdf("""<robot name="door"><link name="frame"/><link name="leaf"><visual>
<origin xyz="0.45 -0.02 1"/><geometry><box size="0.9 0.04 2"/></geometry></visual></link>
<joint name="hinge" type="revolute"><parent link="frame"/><child link="leaf"/></joint></robot>""")
ROBOT = read_urdf('<robot name="r"><link name="base"/></robot>')
UP = np.array([0.0, 0.0, 1.0])


def tree(scene, place, turn=IDENTITY):
    return Tree(scene, (), np.zeros((1, 0)), np.concatenate([place, turn])[None])


@given(st.floats(-0.7, 0.7), st.floats(-np.pi, np.pi))
def test_no_camera_stands_behind_the_door(aside, yaw):
    """Wherever the robot stands before the leaf and however it is turned: on its side, above 0."""
    robot = tree(ROBOT, [0.0, 0.7, 0.8], axis_angle(UP, np.array(yaw)))
    door = tree(DOOR, [aside - 0.45, 0.0, 0.0])
    cameras = parts.cameras(robot, door, None)
    assert [camera.name for camera in cameras] == [
        "from the front", "towards the door", "from above", "along the leaf"]
    for camera in cameras:
        offset = np.subtract(camera.position, camera.target)
        assert np.linalg.norm(offset) > 1.0
        assert np.linalg.norm(offset[:2]) > 1e-3  # the picture has an up
        assert camera.position[2] > 0.0


def test_the_hit_is_seen_from_the_robots_front():
    """The robot's right side faces the door: it is looked in the face, and along the leaf."""
    robot = tree(ROBOT, [0.0, 0.0, 0.8])
    front, _, above, along = parts.cameras(
        robot, tree(DOOR, [-0.4, -0.74, 0.0]), np.array([0.03, -0.74, 0.91]))
    assert front.position[0] > 2.0
    assert above.position[2] > 4.0
    assert abs(along.position[1] + 0.74) < 0.2
    assert along.target == (0.03, -0.74, 0.91)


def test_without_a_leaf_the_page_chooses():
    assert parts.cameras(tree(ROBOT, [0.0, 0.0, 0.8]), None, None) == ()


def test_polygons_of_any_number_of_corners_fit_in_one_array():
    """The corners stay; the last one is repeated; an empty polygon is unknown."""
    triangle, square = np.eye(3)[:, :2], np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])
    found = parts.padded([triangle, np.empty((0, 2)), square])
    np.testing.assert_array_equal(found[0, :, :2], triangle[[0, 1, 2, 2]])
    assert np.isnan(found[1]).all()
    np.testing.assert_array_equal(found[2, :, :2], square)
    assert (found[[0, 2], :, 2] >= 0.0).all()


def test_the_planned_margin_is_a_step_in_each_phase():
    """In millimetres, with a gap between phases; phases without a plan are left out."""
    phases = (Phase("cam", 0.0, 1.0), Phase("post", 1.0, 3.0), Phase("other", 3.0, 4.0))
    plot = parts.margin_plot(np.array([0.0]), np.array([0.05]), {"cam": 0.01, "post": 0.02}, phases)
    measured, planned = plot.curves
    assert measured.values == pytest.approx([50.0])
    np.testing.assert_array_equal(planned.values, [10.0, 10.0, np.nan, 20.0, 20.0, np.nan])
    assert (np.diff(planned.t) > 0.0).all()
    assert planned.dashed


def test_an_unknown_desired_angle_is_no_limit():
    """NaN stands for what was not asked for; two hits with one angle have one line."""
    curve = Curve("encoder", (0, 0, 0), np.zeros(1), np.zeros(1))
    assert parts.door_plot(curve, [np.nan]).limits == ()
    assert [limit.value for limit in parts.door_plot(curve, [0.5, 0.5]).limits] == [28.648]


def test_phases_without_duration_are_left_out():
    """A part of a recording may begin after a phase's end."""
    found = parts.phases_of([(2.0, "prepare"), (2.0, "shift"), (3.0, "cam")], 4.0)
    assert [(phase.name, phase.start, phase.end) for phase in found] == [
        ("shift", 2.0, 3.0), ("cam", 3.0, 4.0)]
