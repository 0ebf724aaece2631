"""How the load is shared between turned feet, and feet that land early or late."""

import math

import numpy as np
import pytest
from hrp2_sim_bridge.control.feet import Touchdown, share_load
from hrp2_sim_bridge.settings import TICK
from hypothesis import given
from hypothesis import strategies as st

CENTERS = np.array([[0.015, 0.105], [0.015, -0.305]])
REACH = np.array([0.105, 0.055])
ANGLES = st.floats(-0.4, 0.4)
BEARS = 30.0
FULL, NONE = 570.0, 0.0
PLACES = st.tuples(st.floats(-0.3, 0.3), st.floats(-0.5, 0.3))


def turn(angle):
    """Return the rotation (2, 2) by an angle."""
    cos, sin = math.cos(angle), math.sin(angle)
    return np.array([[cos, -sin], [sin, cos]])


def shared(zmp, standing=(True, True), inset=0.02, left=0.0, right=0.0):
    turns = np.array([turn(left), turn(right)])
    return share_load(np.array(zmp), 570.0, CENTERS, turns, standing, REACH, inset)


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
    turns = np.array([turn(left + 1.1), turn(right + 1.1)])
    there = share_load(
        all_turned @ zmp, 570.0, CENTERS @ all_turned.T, turns, (True, True), REACH, 0.02)
    np.testing.assert_allclose(there.force, here.force, atol=1e-9)
    np.testing.assert_allclose(there.moment, here.moment, atol=1e-9)


class Walk:
    """A left foot that swings for 0.5 s over the standing right foot, from and to the floor."""

    swing, end = 0.5, 1.5

    def __init__(self) -> None:
        self.touchdown = Touchdown(BEARS)
        self.time = 0.0

    def height(self, time):
        return 0.04 * max(0.0, 1.0 - (2.0 * time / self.swing - 1.0) ** 2)

    def step(self, normal, asked=NONE):
        """Advance by a tick in which the left foot measures a force and was asked for one."""
        self.time += TICK
        height = self.height(self.time)
        return self.touchdown.update(
            np.array([normal, FULL - normal]), np.array([asked, FULL - asked]),
            np.array([height, 0.0]), (height < 0.002, True))

    def run(self, until, force):
        """Return the landings up to a time; `force` gives the force at each time."""
        landings = []
        while self.time < until - 1e-9:
            landings.append(self.step(force(self.time)))
        return landings


def lifted_and_down_again(at):
    """The force on a foot that is gone 20 ms after its lift-off and there again from a time on."""
    return lambda time: FULL / 2.0 if time < 0.02 or time > at else NONE


def test_a_foot_on_time_is_neither_early_nor_late() -> None:
    """A force that outlasts the lift-off by 20 ms does not count as a landing."""
    for landing in Walk().run(Walk.end, lifted_and_down_again(Walk.swing)):
        assert landing.early == landing.late == (False, False)
        assert not landing.descent.any()


def test_a_foot_that_landed_early_stands_and_is_spared_the_rest_of_its_way_down() -> None:
    """Over all ticks the foot is spared exactly the height at which it landed."""
    walk = Walk()
    before = walk.run(0.4, lifted_and_down_again(0.4))
    assert not any(any(landing.early) for landing in before)
    landed = walk.height(walk.time)
    after = walk.run(Walk.end, lifted_and_down_again(0.4))
    assert after[1].early == (True, False)
    assert after[1].standing((False, True)) == (True, True)
    spared = np.sum([landing.descent for landing in after], axis=0)
    np.testing.assert_allclose(spared, [landed, 0.0], atol=0.0035)
    assert min(landing.descent.min() for landing in after) == 0.0


def test_a_foot_that_bounces_off_for_a_moment_has_landed() -> None:
    """A contact counts for 0.1 s: otherwise the load would jump from foot to foot."""
    walk = Walk()
    walk.run(0.38, lifted_and_down_again(2.0))
    assert walk.step(FULL / 2.0).early[0]
    assert all(walk.step(NONE).early[0] for _ in range(10))


def test_a_stumble_on_the_way_up_is_no_landing() -> None:
    """A foot that rises in the reference is not put down."""
    landings = Walk().run(0.24, lambda time: FULL if 0.15 < time < 0.2 else NONE)
    assert not any(any(landing.early) for landing in landings)


def test_a_foot_is_late_from_when_it_shall_bear_load_until_it_does() -> None:
    """A foot is late from when it is asked for load until its contact, and not soon again."""
    walk = Walk()
    walk.run(Walk.swing + 0.02, lifted_and_down_again(2.0))
    assert not walk.step(NONE, asked=1.9 * BEARS).late[0]
    assert walk.step(NONE, asked=2.1 * BEARS).late == (True, False)
    assert walk.step(0.9 * BEARS, asked=FULL).late[0]
    assert not walk.step(1.1 * BEARS, asked=FULL).late[0]
    assert not walk.step(NONE, asked=FULL).late[0]


def test_without_a_step_the_forces_do_not_count() -> None:
    """A foot that a hit or a push unloads after a walk is not searched for the floor."""
    walk = Walk()
    walk.run(Walk.swing + 0.31, lifted_and_down_again(Walk.swing))
    for _ in range(100):
        landing = walk.step(NONE, asked=FULL)
        assert landing.early == landing.late == (False, False)
