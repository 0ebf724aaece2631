"""A door hinged at the left, in each engine: the mirror image of one hinged at the right."""

from dataclasses import replace

import numpy as np
import pytest
from hrp2_sim_bridge.settings import ENGINES
from hrp2_sim_bridge.world import World

NEAR = 0.45  # distance of a door that half-sitting is near to but does not touch [m]
pytestmark = pytest.mark.parametrize("engine", ENGINES)


@pytest.fixture
def worlds(robot, paper_door, engine):
    """Two worlds that differ by the hinge, the right one first."""
    pytest.importorskip(engine)
    made = [World(robot, replace(paper_door, hinge=hinge), NEAR, -0.42, engine=engine)
            for hinge in ("right", "left")]
    yield made
    for world in made:
        world.close()


def test_the_robot_faces_away_with_its_left_side_to_the_door(worlds):
    """And y of odom stays opposite to the push."""
    right, left = (world.links for world in worlds)
    ahead = right.at(-1).turn[:, 0], left.at(-1).turn[:, 0]
    np.testing.assert_allclose(*([each[0]] for each in (ahead[0], -ahead[1])), atol=1e-4)
    assert ahead[0][0] > 0.99
    assert [world.robot_config.contact_link for world in worlds] == ["RARM_LINK3", "LARM_LINK3"]


def test_both_open_alike_and_are_as_far_from_the_robot(worlds):
    """HRP-2's shapes are symmetric, so distances are the same, closed and open."""
    for opened in (False, True):
        right, left = (world.engine.leaf_distance(1.0) for world in worlds)
        assert left == pytest.approx(right, abs=2e-3)
        assert (left > 0.2) == opened
        for world in worlds if not opened else ():
            world.push_door(20.0, 0.1)
            for _ in range(60):
                world.step()
    angles = [world.log()["door_angle"] for world in worlds]
    np.testing.assert_allclose(*angles, atol=1e-4)
    assert angles[1].max() > np.radians(20.0)


def test_a_robot_that_is_pushed_touches_the_door_at_its_left(worlds):
    """With the twin of the right one's link, at the mirrored place."""
    logs = []
    for world in worlds:
        world.push_robot(np.array([0.0, -60.0, 0.0]))
        for _ in range(120):
            world.step()
            if world.engine.touch().force > 0.0:
                break
        logs.append(world.log())
    (right, there), (left, here) = (
        (log, np.flatnonzero(log["contact_force"] > 0.0)[0]) for log in logs)
    names = [str(log["link_names"][log["contact_link"][row]]) for log, row in
             ((right, there), (left, here))]
    assert [name[0].upper() for name in names] == ["R", "L"]
    np.testing.assert_allclose(
        left["contact_point"][here], right["contact_point"][there] * [-1.0, 1.0, 1.0], atol=0.02)
    assert (str(right["hinge"]), str(left["hinge"])) == ("right", "left")
