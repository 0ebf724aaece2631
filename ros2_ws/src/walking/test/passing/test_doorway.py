"""Rectangles on the floor, and the doorway that consists of them."""

import math

import numpy as np
import pytest
from door_model.door.geometry import Frame, Leaf
from hypothesis import given
from hypothesis import strategies as st
from walking.footsteps.rectangles import corners, gaps
from walking.passing.doorway import Doorway

POSES = st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(-7.0, 7.0))
SIDES = st.tuples(st.floats(-0.5, 0.0), st.floats(0.01, 0.5), st.floats(-0.5, 0.0),
                  st.floats(0.01, 0.5))
DOOR = Doorway(np.array([-0.4, -0.7]), Leaf(50.0, 0.9, 2.0, 0.04), Frame(0.91, 0.10, 0.14))
BODY = (-0.2, 0.2, -0.3, 0.3)


def points(rectangle, pose, count=12):
    """Points of a rectangle's area on a grid, (N, 2)."""
    x, y = np.meshgrid(np.linspace(*rectangle[:2], count), np.linspace(*rectangle[2:], count))
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    return np.column_stack([pose[0] + cos * x.ravel() - sin * y.ravel(),
                            pose[1] + sin * x.ravel() + cos * y.ravel()])


@given(SIDES, st.lists(POSES, min_size=1, max_size=20), st.floats(0.0, 1.0))
def test_distances_from_walls_are_the_same_where_only_small_ones_matter(body, poses, within):
    """Larger ones may be infinite, and are never small."""
    every = DOOR.wall_gaps(body, np.array(poses))
    found = DOOR.wall_gaps(body, np.array(poses), within)
    small = every <= within
    assert (found[small] == every[small]).all()
    assert (found[~small] >= every[~small]).all()


@given(SIDES, POSES, SIDES, POSES)
def test_a_gap_is_at_most_the_true_distance_and_negative_where_rectangles_overlap(
        one, pose, two, other):
    gap = float(gaps(one, np.array([pose]), two, np.array([other]))[0])
    a, b = points(one, pose), points(two, other)
    nearest = float(np.linalg.norm(a[:, None] - b[None], axis=2).min())
    assert gap <= nearest + 1e-9
    turned = b - np.asarray(pose[:2])
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    x, y = cos * turned[:, 0] + sin * turned[:, 1], cos * turned[:, 1] - sin * turned[:, 0]
    inside = (x > one[0]) & (x < one[1]) & (y > one[2]) & (y < one[3])
    assert not (inside.any() and gap > 0.0)


@given(SIDES, POSES, SIDES, POSES)
def test_a_gap_is_the_same_seen_from_either_rectangle(one, pose, two, other):
    a, b = np.array([pose]), np.array([other])
    assert gaps(one, a, two, b) == pytest.approx(gaps(two, b, one, a), abs=1e-12)


@given(POSES)
def test_corners_keep_the_rectangles_sides(pose):
    found = corners(BODY, np.array([pose]))[0]
    lengths = np.linalg.norm(np.roll(found, -1, axis=0) - found, axis=1)
    assert sorted(lengths) == pytest.approx([0.4, 0.4, 0.6, 0.6])


def test_the_leaf_leaves_the_opening_free_when_it_is_wide_open():
    """A body in the middle of the opening is in the closed leaf, and free of the open one."""
    pose = np.array([[0.05, -0.72, -0.5 * math.pi]])
    assert DOOR.leaf_gaps(BODY, pose, np.array([0.0]))[0] < 0.0
    assert DOOR.leaf_gaps(BODY, pose, np.array([0.5 * math.pi]))[0] == pytest.approx(0.15, abs=1e-3)
    assert DOOR.wall_gaps(BODY, pose)[0] == pytest.approx(0.155, abs=1e-3)


def test_clear_means_beyond_the_wall_and_outside_the_leafs_circle():
    """The distance to the circle counts from the nearest point of an edge, not from a corner."""
    far = DOOR.far_face
    before, inside, clear = np.array([[0.0, 0.5, 0.0], [0.0, far - 0.5, 0.0], [0.0, -3.0, 0.0]])
    assert DOOR.clear_by(BODY, before[None])[0] < 0.0
    assert DOOR.clear_by(BODY, inside[None])[0] < 0.0
    assert DOOR.clear_by(BODY, clear[None])[0] == pytest.approx(
        -(-3.0 + 0.3) - 0.7 - math.hypot(0.9, 0.04), abs=0.06)
    beside = np.array([[DOOR.hinge[0], -3.0, 0.0]])
    assert DOOR.clear_by(BODY, beside)[0] == pytest.approx(2.0 - math.hypot(0.9, 0.04))
