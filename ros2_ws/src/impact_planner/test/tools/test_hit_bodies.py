"""The comparison of what could hit the leaf."""

from math import radians

import pytest
from impact_planner.task.settings import PlannerSettings
from impact_planner.tools.hit_bodies import bodies, compare


@pytest.fixture(scope="module")
def hits(robot, known):
    over = bodies(robot.config, (0.44,), ("RLEG_LINK1",))
    return list(compare(over, known, PlannerSettings(), radians(25.0)))


def test_every_body_gives_the_leaf_the_same_momentum(hits):
    """Impulse times lever is I_A w' and what the closer takes, whatever hits."""
    for hit in hits:
        if hit.transfer is not None:
            speeds, response = hit.transfer.speeds, hit.transfer.response
            assert 0.42 * speeds.impulse - hit.transfer.braking == pytest.approx(
                12.75 * 0.635, rel=1e-3)
            assert response.omega == pytest.approx(0.635, rel=0.10)
