"""A door beside a walk: what is in the way, and the ways around it."""

import math

import numpy as np
import pytest
from door_model.door.geometry import Frame, Leaf
from hypothesis import given
from hypothesis import strategies as st
from walking.errors import NotReady, WalkInfeasible
from walking.footsteps.footstep import Pose, Stance, stances
from walking.footsteps.planner import plan_footsteps
from walking.footsteps.rectangles import corners
from walking.passing.doorway import Doorway
from walking.passing.surroundings import GAP, Surroundings

DOOR = Doorway(np.zeros(2), Leaf(50.0, 0.9, 2.0, 0.04), Frame(0.91, 0.10, 0.14))
AXES = Pose(-0.4, -0.7, 0.3)
BODY = (-0.2, 0.21, -0.41, 0.41)
PLACES = st.tuples(st.floats(-2.5, 2.5), st.floats(-2.5, 2.5), st.floats(-3.1, 3.1))


def beside(degrees=0.0):
    return Surroundings(DOOR, AXES, math.radians(degrees), BODY)


def footsteps(robot, begin, goal, around):
    """Footsteps between places that are seen from the door."""
    stance = Stance.around(AXES.moved(*begin), robot.config.footsteps.width)
    return stance, plan_footsteps(robot.config, stance, AXES.moved(*goal), room=around)


@given(PLACES, PLACES, st.sampled_from([0.0, 25.0, 80.0]))
def test_footsteps_never_lead_through_wall_or_leaf(robot, begin, goal, degrees):
    """No corner of the body comes into them, if it is not in them from the beginning."""
    around = beside(degrees)
    if around._gaps(np.array([begin])).min() < GAP:
        return
    try:
        stance, steps = footsteps(robot, begin, goal, around)
    except WalkInfeasible:
        return
    seen = np.array([each.middle.seen_from(AXES) for each in stances(stance, steps)])
    body = corners(BODY, seen).reshape(-1, 2)
    cos, sin = math.cos(around.angle), math.sin(around.angle)
    x, y = cos * body[:, 0] - sin * body[:, 1], sin * body[:, 0] + cos * body[:, 1]
    assert not ((x > 0.0) & (x < 0.9) & (y > -0.04) & (y < 0.0)).any()
    beyond = seen[:, 1] < 0.0
    assert beyond.all() or not beyond.any()


def test_what_is_in_the_way_is_named_with_its_distance(robot):
    """From 0.8 m before the shut door, and beside it."""
    for x, what in ((0.45, "the shut door"), (1.5, "the wall")):
        with pytest.raises(WalkInfeasible, match=what) as refused:
            footsteps(robot, (x, 0.8, 0.0), (x, -1.0, 0.0), beside())
        assert 0.1 < refused.value.value < 0.5


def test_a_leaf_that_stands_open_is_walked_around(robot):
    """Beyond the door, from one side of the leaf to the other."""
    begin, goal = (-0.9, -1.0, 0.0), (0.9, -1.0, 0.0)
    direct = len(footsteps(robot, begin, goal, None)[1])
    assert len(footsteps(robot, begin, goal, beside(85.0))[1]) > direct + 3


def test_a_leaf_is_not_let_go_onto_the_robot():
    """In the doorway it may not, where a hit begins it may."""
    with pytest.raises(NotReady, match="80 deg"):
        beside(80.0).require_let_go(AXES.moved(0.5, -0.3))
    beside(80.0).require_let_go(AXES.moved(0.4, 0.7))
