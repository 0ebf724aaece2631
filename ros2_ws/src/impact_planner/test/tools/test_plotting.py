"""The figure of a plan shows everything at its place."""

import numpy as np
import pytest

pytest.importorskip("matplotlib")
from impact_planner.tools.plotting import (
    body_outlines,
    configuration_at_hit,
    door_course,
    draw_plan,
)


def test_the_figure_is_written_in_silence(robot, plan, tmp_path, caplog, recwarn):
    """The plan is drawn without warnings or log messages."""
    path = tmp_path / "plan.png"
    draw_plan(plan, robot, path)
    assert path.read_bytes()[:4] == b"\x89PNG"
    assert not caplog.records
    assert not recwarn.list


def test_no_outline_reaches_into_the_leaf(robot, plan):
    """At the hit nothing of the robot is nearer to the leaf's face than the elbow."""
    outlines = body_outlines(robot, configuration_at_hit(plan, robot), (1, 0))
    face = plan.contact_point[1]
    assert min(corners[:, 0].min() for _, corners in outlines) == pytest.approx(face, abs=1e-3)


def test_the_door_opens_to_the_peak_falls_back_and_is_held(plan):
    """The course has no jump, its peak is the predicted one, and its end the desired angle."""
    time, angle, start = door_course(plan)
    assert np.all(np.diff(time) > 0.0)
    assert angle[0] == plan.initial_angle
    free = angle[time < start]
    assert free.max() == pytest.approx(plan.peak_angle, abs=2e-3)
    assert time[np.argmax(free)] == pytest.approx(plan.peak_time, abs=0.03)
    assert np.abs(np.diff(angle)).max() < 0.02
    assert 0.0 < angle[time >= start].min() < plan.desired_opening_angle
    assert angle[-1] == pytest.approx(plan.desired_opening_angle, abs=1e-3)
