"""What a yielding hand does under a force, against the driver's own admittance."""

import numpy as np
import pytest
from hrp2_sim_bridge.control.admittance import (
    FADE,
    FARTHEST,
    FASTEST,
    Admittance,
    HandImpedance,
)
from hrp2_sim_bridge.settings import TICK
from hypothesis import given
from hypothesis import strategies as st
from walking.passing.settings import PassageSettings
from walking.passing.yielding import yielded

SETTINGS = PassageSettings()
TIME = np.arange(0.0, 8.0, 0.02)


def driver_yields(force, settings):
    """Displacement of the simulated driver's hand at TIME under a force of the time, [m]."""
    hand = Admittance()
    hand.change(HandImpedance(*settings.impedance))
    for _ in range(round(FADE / TICK)):  # the change has faded in
        hand.update(np.zeros(3))
    ticks = np.arange(0.0, TIME[-1] + TICK, TICK)
    found = []
    for now in ticks:
        found.append(hand.place[0])
        hand.update(np.array([force(now + TICK), 0.0, 0.0]))
    return np.interp(TIME, ticks, found)


@given(first=st.floats(0.0, 90.0), last=st.floats(0.0, 90.0), stiffness=st.floats(100.0, 2000.0),
       damping=st.floats(100.0, 2000.0), mass=st.floats(2.0, 20.0))
def test_it_is_where_the_drivers_hand_is(first, last, stiffness, damping, mass):
    """To 2 mm, also where the driver's bounds of displacement and speed hold it."""
    settings = PassageSettings(
        hand_stiffness=stiffness, hand_damping=damping, hand_mass=mass)

    def force(now):
        return first + (last - first) * np.clip(np.asarray(now) / 4.0, 0.0, 1.0)

    found = yielded(TIME, force(TIME), settings)
    np.testing.assert_allclose(found, driver_yields(force, settings), atol=0.002)


def test_the_bounds_are_those_of_the_simulated_driver():
    assert (SETTINGS.hand_farthest, SETTINGS.hand_fastest) == (FARTHEST, FASTEST)


@given(force=st.floats(0.0, 45.0))
def test_it_ends_at_force_over_stiffness(force):
    time = np.linspace(0.0, 20.0, 100)
    assert yielded(time, np.full(100, force), SETTINGS)[-1] == pytest.approx(
        force / SETTINGS.hand_stiffness, abs=1e-6)
