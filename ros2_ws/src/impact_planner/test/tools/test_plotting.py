"""The figure of a plan shows everything at its place."""

import numpy as np
import pytest
from impact_planner.hit.leaf import LeafFrame
from impact_planner.task.settings import PlannerSettings
from impact_planner.tools.plan_scene import caught_after, door_course, plan_scene

SETTINGS = PlannerSettings()


@pytest.fixture(scope="module")
def case(robot, plan):
    """The plan, the robot and the scene."""
    return plan, robot, plan_scene(plan, robot)


def test_the_figure_is_written_in_silence(case, tmp_path, caplog, recwarn):
    """The plan is drawn without warnings or log messages."""
    pytest.importorskip("matplotlib")
    from impact_planner.tools.plotting import draw_plan

    plan, robot, _ = case
    path = tmp_path / "plan.png"
    draw_plan(plan, robot, SETTINGS, path)
    assert path.read_bytes()[:4] == b"\x89PNG"
    assert not caplog.records
    assert not recwarn.list


def test_b_is_on_the_leaf_where_the_elbow_touches_it(case):
    """B is on the leaf at l_B, one radius from the centre of the contact body."""
    plan, robot, scene = case
    leaf = LeafFrame(scene.hinge, plan.initial_angle)
    assert leaf.gap(scene.b) == pytest.approx(0.0, abs=1e-6)
    assert leaf.radius(scene.b) == pytest.approx(plan.l_b, abs=1e-6)
    elbow = robot.contact_position(scene.q_hit)
    assert np.linalg.norm(scene.b - elbow) == pytest.approx(robot.config.contact_radius, abs=2e-4)


def test_the_door_opens_to_the_peak_and_falls_back(case):
    """The door opens to its peak, closes without a jump, and is led by the hand."""
    plan, robot, _ = case
    time, angle, start = door_course(plan)
    assert np.all(np.diff(time) > 0.0)
    assert angle[0] == plan.initial_angle
    free = angle[time < start]
    assert free.max() == pytest.approx(plan.peak_angle, abs=2e-3)
    assert time[np.argmax(free)] == pytest.approx(plan.peak_time, abs=0.03)
    assert np.abs(np.diff(angle)).max() < 0.02
    caught = start + caught_after(plan, robot)
    assert angle[-1] == pytest.approx(plan.desired_opening_angle, abs=1e-3)
    falling = (time > start) & (time < caught)
    assert np.all(np.diff(angle[falling]) < 0.0)
    assert 0.0 < angle[time >= caught].min() < angle[time >= caught][0]
