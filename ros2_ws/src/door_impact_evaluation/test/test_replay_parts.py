"""Parts of a replay: polygons, planned margins, and places to look from."""

import numpy as np
import pytest
from door_impact_evaluation.report import replay_parts as parts
from door_impact_view.replay.recording import Phase


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


def test_phases_without_duration_are_left_out():
    """A part of a recording may begin after a phase's end."""
    found = parts.phases_of([(2.0, "prepare"), (2.0, "shift"), (3.0, "cam")], 4.0)
    assert [(phase.name, phase.start, phase.end) for phase in found] == [
        ("shift", 2.0, 3.0), ("cam", 3.0, 4.0)]
