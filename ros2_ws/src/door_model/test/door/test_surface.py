"""The leaf's surface shows two free masses the restitution and the duration that it is made for."""

import math

import pytest
from door_model.door.surface import (
    LEAST_LEVER,
    MOST_DAMPING,
    ROBOT_MASS,
    free_contact,
    mass_of_hit,
    surface,
)
from door_model.errors import DoorParameterError
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp


def integrated(stiffness, damping, mass, speed):
    """Restitution and duration of a contact of free masses, by numerical integration."""

    def law(_, state):
        return [state[1], -(stiffness * state[0] + damping * state[1]) / mass]

    def parted(_, state):
        return stiffness * state[0] + damping * state[1]

    parted.terminal, parted.direction = True, -1.0
    found = solve_ivp(law, (0.0, 10.0), [0.0, speed], events=parted, rtol=1e-10, atol=1e-13)
    return -found.y[1, -1] / speed, found.t[-1]


@given(st.floats(0.02, 1.0), st.floats(0.002, 0.1), st.floats(5.0, 60.0), st.floats(0.05, 2.0))
def test_free_masses_part_with_the_restitution_after_the_duration(
        restitution, duration, mass, speed):
    """Whatever their speed, both figures are right to 1e-5."""
    made = surface(restitution, duration, mass)
    shown, took = integrated(made.stiffness, made.damping, mass, speed)
    assert shown == pytest.approx(restitution, abs=1e-5)
    assert took == pytest.approx(duration, rel=1e-5)


@given(st.floats(0.0, MOST_DAMPING), st.floats(1e-9, 1e-3))
def test_restitution_and_duration_are_continuous_in_the_damping(ratio, step):
    """Also at critical damping, where the formulas change, small steps change little."""
    for here in (ratio, 1.0 - step):
        one, other = free_contact(here), free_contact(here + 2.0 * step)
        assert one[0] == pytest.approx(other[0], abs=10.0 * step + 1e-7)
        assert one[1] == pytest.approx(other[1], abs=10.0 * step + 1e-5)


def test_the_mass_of_a_hit_is_that_of_robot_and_leaf_together():
    """It is the reduced mass; levers shorter than 0.1 m count as 0.1 m."""
    assert 1.0 / mass_of_hit(12.75, 0.42) == pytest.approx(1.0 / ROBOT_MASS + 0.42**2 / 12.75)
    assert mass_of_hit(12.75, -0.42) == mass_of_hit(12.75, 0.42)
    assert mass_of_hit(12.75, 0.0) == mass_of_hit(12.75, LEAST_LEVER)


@pytest.mark.parametrize("numbers", [(1.1, 0.015, 30.0), (0.5, math.inf, 30.0)])
def test_what_is_no_surface_is_refused(numbers):
    with pytest.raises(DoorParameterError):
        surface(*numbers)
