"""Feet that land earlier or later than the reference says."""

import numpy as np
from hrp2_sim_bridge.control.touchdown import Touchdown
from hrp2_sim_bridge.settings import TICK

BEARS = 30.0
FULL, NONE = 570.0, 0.0


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
    """Nor is one whose force outlasts its lift-off."""
    for landing in Walk().run(Walk.end, lifted_and_down_again(Walk.swing)):
        assert landing.early == landing.late == (False, False)
        assert not landing.descent.any()


def test_a_foot_that_landed_early_stands_and_is_spared_the_rest_of_its_way_down() -> None:
    """The ways of all ticks together are the height at which it landed."""
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
    """Not before, and not again within a tenth of a second."""
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
