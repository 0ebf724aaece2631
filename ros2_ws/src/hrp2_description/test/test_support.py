"""Tests of the support polygon and of margins in it."""

import numpy as np
import pytest
from hrp2_description.errors import DegeneratePolygonError
from hrp2_description.support import polygon_margin, sole_corners, support_polygon
from hypothesis import assume, given
from hypothesis import strategies as st

SOLE = (-0.10, 0.13, -0.075, 0.055)
number = st.floats(-1.0, 1.0, allow_nan=False)
clouds = st.lists(st.tuples(number, number), min_size=3, max_size=25)


def _hull(points):
    try:
        return support_polygon(points)
    except DegeneratePolygonError:
        assume(False)


def test_square_margins():
    """The margins of the unit square are right inside, on an edge, outside, and off a corner."""
    hull = support_polygon([[0, 0], [1, 0], [1, 1], [0, 1]])
    points = [[0.5, 0.5], [0.2, 0.5], [1, 0.3], [1.5, 0.5], [1.3, 1.4]]
    np.testing.assert_allclose(
        polygon_margin(points, hull), [0.5, 0.2, 0.0, -0.5, -0.5], atol=1e-12
    )


@given(clouds)
def test_hull_holds_all_points_and_is_counter_clockwise(points):
    """No point lies outside its hull, and every corner is one of the points to a nanometre."""
    hull = _hull(points)
    assert polygon_margin(points, hull).min() > -1e-9
    apart = np.abs(hull[:, None] - np.array(points)).max(axis=-1)
    assert apart.min(axis=1).max() < 1e-9
    x, y = hull.T
    assert x @ np.roll(y, -1) - y @ np.roll(x, -1) > 0.0


@given(clouds, st.tuples(number, number), st.floats(-3, 3), st.tuples(number, number))
def test_margin_does_not_depend_on_the_frame(points, point, angle, shift):
    """Rotating and translating everything leaves the margins unchanged."""
    hull = _hull(points)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    before = polygon_margin(point, hull)
    after = polygon_margin(turn @ point + shift, hull @ turn.T + shift)
    assert float(before) == pytest.approx(float(after), abs=1e-9)


@given(clouds, st.tuples(number, number))
def test_margin_agrees_with_a_dense_walk_along_the_edges(points, point):
    """Its absolute value is the distance to the nearest point of the outline."""
    hull = _hull(points)
    share = np.linspace(0.0, 1.0, 400)[:, None, None]
    outline = (1 - share) * hull + share * np.roll(hull, -1, axis=0)
    nearest = np.linalg.norm(outline - np.array(point), axis=-1).min()
    assert abs(float(polygon_margin(point, hull))) == pytest.approx(nearest, abs=0.01)


@pytest.mark.parametrize("points", [[], [[0, 0], [1, 1], [2, 2]]])
def test_degenerate_hulls_are_errors(points):
    """No point, one point and a line are not polygons."""
    with pytest.raises(DegeneratePolygonError):
        support_polygon(points)


def test_nan_is_an_error_in_a_hull_and_nan_as_a_point():
    """A polygon of NaN is refused; the margin of a point that is NaN is NaN."""
    with pytest.raises(DegeneratePolygonError):
        support_polygon([[0, 0], [1, 0], [np.nan, 1]])
    hull = support_polygon([[0, 0], [1, 0], [0, 1]])
    assert np.isnan(polygon_margin([np.nan, 0.2], hull))


@pytest.mark.parametrize(
    "hull",
    [
        [[0, 0], [0, 1], [1, 1], [1, 0]],
        [[0, 0], [2, 0], [1, 0.1], [1, 2]],
    ],
    ids=["clockwise", "dented"],
)
def test_margin_refuses_what_is_no_convex_polygon(hull):
    """A polygon that would give a wrong sign is an error."""
    with pytest.raises(DegeneratePolygonError):
        polygon_margin([0.1, 0.1], hull)


def test_sole_corners_from_plane_pose_and_matrix_agree():
    """x, y, yaw and the homogeneous matrix of the same pose give the same corners."""
    x, y, yaw = 0.3, -0.295, 0.4
    matrix = np.eye(4)
    matrix[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    matrix[:2, 3] = x, y
    np.testing.assert_allclose(sole_corners(SOLE, (x, y, yaw)), sole_corners(SOLE, matrix))
    with pytest.raises(ValueError, match="shape"):
        sole_corners(SOLE, (x, y))


def test_both_soles_side_by_side():
    """HRP-2's soles at half-sitting span 0.23 x 0.34 m around the origin."""
    left = (-0.10, 0.13, -0.055, 0.075)
    hull = support_polygon(sole_corners(left, (0, 0.095, 0)), sole_corners(SOLE, (0, -0.095, 0)))
    assert len(hull) == 4
    np.testing.assert_allclose(np.ptp(hull, axis=0), [0.23, 0.34])
    assert polygon_margin([0.0, 0.0], hull) == pytest.approx(0.10)
