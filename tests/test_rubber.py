"""The whole motion on HRP-2's rubber soles, with the stabilizer and without it."""

from typing import Any

import numpy as np
import pytest
from door_impact_bringup import evaluation
from door_impact_bringup.rehearsal import Rehearsal, rehearse
from hrp2_description.robot import load_robot_config
from impact_planner.execution import Outcome


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Rehearsal:
    return rehearse(25.0, tmp_path_factory.mktemp("rubber") / "run.npz", sole="rubber")


def test_the_stabilized_robot_stands_through_the_whole_motion(run: Rehearsal) -> None:
    """From half-sitting to the held door, with its base never 2 deg off the vertical."""
    assert run.log.fell == ""
    assert run.execution.outcome is Outcome.SUCCESS
    assert np.degrees(evaluation.tilt(run.log.motion.base_orientation).max()) < 2.0


def test_the_zmp_stays_inside_the_support_polygon(run: Rehearsal) -> None:
    """By a centimeter, as a mean over 20 ms."""
    motion = run.log.motion
    inside = (motion.t > 0.1) & (motion.t < motion.t[-1] - 0.05)
    support = evaluation.support(motion, load_robot_config(), window=evaluation.WINDOW)
    assert np.nanmin(support.margin[inside]) > 0.01


def test_the_hit_is_nearly_that_of_rigid_soles(run: Rehearsal) -> None:
    """One contact, nearly the planned speed, and an opening a few degrees off, as its timing is."""
    assert run.impact is not None
    assert run.impact.contacts_before_peak == 1
    assert run.impact.v_rb == pytest.approx(run.plan.v_rb, rel=0.06)
    peak = np.degrees(run.log.motion.door_angle[run.impact.peak])
    assert peak == pytest.approx(25.0, abs=5.0)


def test_without_the_stabilizer_it_falls_before_the_run_up(tmp_path: Any) -> None:
    """Rubber alone does not carry a body over one foot: it never gets to the door."""
    run = rehearse(25.0, tmp_path / "run.npz", sole="rubber", stabilizer=False)
    assert run.log.fell
    assert run.impact is None
