import math

import numpy as np
import pytest
from hrp2_sim_bridge.control.admittance import (
    FADE,
    FARTHEST,
    FASTEST,
    RETURN_SPEED,
    Admittance,
    HandImpedance,
)
from hrp2_sim_bridge.settings import TICK


def places(hand, force, ticks):
    """Return the displacements (ticks, 3) of a hand under a force."""
    found = []
    for _ in range(ticks):
        hand.update(np.asarray(force, dtype=float))
        found.append(hand.place)
    return np.array(found)


def compliant(**values):
    """Return a hand on which a force counts fully."""
    hand = Admittance()
    hand.change(HandImpedance(**values))
    places(hand, (0.0, 0.0, 0.0), round(FADE / TICK))
    return hand


def test_a_steady_force_displaces_by_force_over_stiffness() -> None:
    """A hand with much damping yields by F / K in the direction of the force, no farther."""
    found = places(compliant(damping=400.0), (3.0, -6.0, 2.0), 3000)
    np.testing.assert_allclose(found[-1], np.array([3.0, -6.0, 2.0]) / 200.0, rtol=1e-3)
    assert found[:, 0].max() <= 3.0 / 200.0


def test_the_motion_is_that_of_mass_damper_and_spring() -> None:
    """The integration errs by less than 5 % of the course of the differential equation."""
    found = places(compliant(), (8.0, 0.0, 0.0), 400)[:, 0]
    x = v = 0.0
    exact = []
    for _ in range(400):
        for _ in range(100):
            v += (8.0 - 150.0 * v - 200.0 * x) / 5.0 * TICK / 100.0
            x += v * TICK / 100.0
        exact.append(x)
    assert np.abs(found - np.array(exact)).max() < 0.05 * exact[-1]


@pytest.mark.parametrize("force", [200.0, 1e300])
def test_a_large_force_saturates_the_displacement_and_its_speed(force) -> None:
    """Nothing winds up: when the force ends, the hand returns at once."""
    hand = compliant()
    found = places(hand, (0.0, force, 0.0), 600)
    assert np.linalg.norm(found, axis=1).max() <= FARTHEST + 1e-12
    assert np.linalg.norm(np.diff(found, axis=0), axis=1).max() <= FASTEST * TICK + 1e-12
    back = places(hand, (0.0, 0.0, 0.0), 20)[:, 1]
    assert (np.diff(np.append(found[-1, 1], back)) < 0.0).all()


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_force_without_numbers_stops_the_displacement(bad) -> None:
    """The hand stays, goes on with the next good reading, and becomes stiff in any case."""
    hand = compliant()
    before = places(hand, (10.0, 0.0, 0.0), 100)[-1]
    np.testing.assert_array_equal(places(hand, (0.0, bad, 0.0), 50)[-1], before)
    assert places(hand, (10.0, 0.0, 0.0), 50)[-1, 0] > before[0]
    hand.change(None)
    assert not places(hand, (0.0, bad, 0.0), 600)[-1].any()


def test_every_change_is_smooth() -> None:
    """Under 30 N a hand is made soft, harder and stiff on its way: its speed never jumps."""
    hand, speed = Admittance(), [np.zeros(3)]
    soft, hard = HandImpedance(), HandImpedance(1000.0, 1000.0, 20.0)
    changes = {10: soft, 60: None, 62: soft, 200: hard, 300: None, 310: soft, 400: None,
               600: hard, 605: None}
    for tick in range(1300):
        if tick in changes:
            hand.change(changes[tick])
        hand.update(np.array([0.0, 30.0, 0.0]))
        speed.append(hand.speed)
        assert tick > 10 or np.abs(hand.speed).max() < 0.001
    assert np.abs(np.diff(speed, axis=0)).max() < 0.03
    assert not hand.active


@pytest.mark.parametrize(("force", "seconds"), [(2.0, 0.6), (100.0, 2.0)])
def test_a_hand_that_becomes_stiff_returns_slowly(force, seconds) -> None:
    """A hand that is 10 or 120 mm away returns in time, never at more than 0.1 m/s."""
    hand = compliant()
    places(hand, (force, 0.0, 0.0), 1000)
    hand.change(None)
    back = places(hand, (force, 0.0, 0.0), round(seconds / TICK))
    assert not back[-1].any()
    assert np.abs(np.diff(back[:, 0])).max() <= RETURN_SPEED * TICK + 1e-12


@pytest.mark.parametrize("delay", [1, 2, 3])
def test_the_default_is_stable_at_a_wall(delay) -> None:
    """Through one to three ticks and an arm of 10 000 N/m no motion grows, and most dies out."""
    hand, queue, felt = compliant(), [np.zeros(3)] * delay, []
    for _ in range(2000):
        force = -10_000.0 * (queue.pop(0) + np.array([0.0, -0.002, 0.0]))  # 2 mm into the wall
        hand.update(force)
        queue.append(hand.place)
        felt.append(force[1])
    swing = [np.ptp(felt[begin : begin + 200]) for begin in (200, 800, 1800)]
    assert swing[2] <= swing[1] <= swing[0]
    assert swing[2] < 0.1
