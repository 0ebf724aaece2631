"""How the load is shared between the feet, whose soles may be turned."""

import math

import numpy as np
import pytest
from hrp2_sim_bridge.control.load_sharing import Soles, share_load
from hypothesis import given
from hypothesis import strategies as st

CENTERS = np.array([[0.015, 0.105], [0.015, -0.305]])
REACH = np.array([0.105, 0.055])
ANGLES = st.floats(-0.4, 0.4)
PLACES = st.tuples(st.floats(-0.3, 0.3), st.floats(-0.5, 0.3))


def turn(angle):
    """Return the rotation (2, 2) by an angle."""
    cos, sin = math.cos(angle), math.sin(angle)
    return np.array([[cos, -sin], [sin, cos]])


def shared(zmp, standing=(True, True), inset=0.02, left=0.0, right=0.0):
    soles = Soles(CENTERS, np.array([turn(left), turn(right)]), standing)
    return share_load(np.array(zmp), 570.0, soles, REACH, inset)


def zmp_of(loads, left=0.0, right=0.0):
    """Return the ZMP of the forces and moments of both feet."""
    total = loads.force.sum()
    moment = turn(left) @ loads.moment[0] + turn(right) @ loads.moment[1]
    x = (loads.force @ CENTERS[:, 0] - moment[1]) / total
    y = (loads.force @ CENTERS[:, 1] + moment[0]) / total
    return np.array([x, y])


def test_a_zmp_under_one_sole_or_one_sole_on_the_floor_is_borne_by_it_alone() -> None:
    """A ZMP near a sole's middle, or with one sole in the air, loads one sole alone."""
    assert shared((0.0, 0.09)).force.tolist() == [570.0, 0.0]
    assert shared((0.0, 0.06), standing=(False, True)).force.tolist() == [0.0, 570.0]


def test_no_foot_is_asked_for_more_than_its_sole_bears() -> None:
    """A ZMP outside the soles is moved to their edges, and its distance is reported."""
    loads = shared((0.4, 0.3))
    assert loads.beyond == pytest.approx(0.28)
    np.testing.assert_allclose(zmp_of(loads), CENTERS[0] + REACH, atol=1e-12)


def test_sharing_is_continuous() -> None:
    """A shift of the ZMP by 0.1 mm changes the loads by less than 2 N and 0.3 N m."""
    path = [shared((0.02, y)) for y in np.arange(-0.35, 0.15, 1e-4)]
    assert np.abs(np.diff([loads.force for loads in path], axis=0)).max() < 2.0
    assert np.abs(np.diff([loads.moment for loads in path], axis=0)).max() < 0.3


@given(PLACES, ANGLES, ANGLES)
def test_turned_soles_make_the_zmp_that_was_asked_up_to_what_they_say(zmp, left, right) -> None:
    """Whatever is beyond the soles is reported, and no sole's own edge is passed."""
    loads = shared(zmp, left=left, right=right)
    missed = np.abs(zmp_of(loads, left, right) - zmp).max()
    assert missed == pytest.approx(loads.beyond, abs=1e-9)
    for force, (roll, pitch) in zip(loads.force, loads.moment, strict=True):
        assert abs(roll) <= force * REACH[1] + 1e-9
        assert abs(pitch) <= force * REACH[0] + 1e-9


@given(PLACES, ANGLES, ANGLES)
def test_the_share_does_not_depend_on_where_north_is(zmp, left, right) -> None:
    """With everything turned alike, each sole bears the same about its own axes."""
    here = shared(zmp, left=left, right=right)
    all_turned = turn(1.1)
    soles = Soles(
        CENTERS @ all_turned.T, np.array([turn(left + 1.1), turn(right + 1.1)]), (True, True))
    there = share_load(all_turned @ zmp, 570.0, soles, REACH, 0.02)
    np.testing.assert_allclose(there.force, here.force, atol=1e-9)
    np.testing.assert_allclose(there.moment, here.moment, atol=1e-9)


def test_a_turned_sole_bears_farther_in_its_own_direction() -> None:
    """A sole that points to the left reaches 0.105 m there, and only 0.055 m ahead."""
    alone = {"standing": (True, False), "left": math.pi / 2.0}
    assert shared((0.015, 0.205), **alone).beyond == pytest.approx(0.0, abs=1e-12)
    assert shared((0.085, 0.105), **alone).beyond == pytest.approx(0.015)
