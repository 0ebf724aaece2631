"""Energy of a swing with a real closer: what leaf and spring lose is heat in damper and hinge."""

import math
from dataclasses import replace

import numpy as np
import pytest
from door_model.door.closer import FourBarCloser
from door_model.door.door import Door, Zone
from door_model.motion.dynamics import initial_velocity, simulate
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import cumulative_trapezoid

CLOSER = FourBarCloser(0.195, 0.204, 0.220, 0.265, 0.34)
PAPER = Door(12.75, 0.06, 1.13, 3.2, CLOSER)
viscosities = st.floats(0.0, 1.5)
zones = st.none() | st.builds(Zone, st.floats(0.02, 0.8), viscosities)
doors = st.builds(
    Door,
    i_a=st.floats(3.0, 60.0),
    c_c=st.floats(0.0, 0.5),
    k_c=st.floats(0.1, 4.0),
    tau_c0_prime=st.floats(2.0, 12.0),
    closer=st.just(CLOSER),
    c_c_closing=st.none() | viscosities,
    backcheck=zones,
    latch=zones,
    friction=st.floats(0.0, 3.0),
)


def energy_of(door: Door, theta: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """Return kinetic energy plus the integral of eq. (12), since eta is the derivative of f."""
    f, shut = door.closer.f(theta), door.closer.f(0.0)
    spring = (f - shut) * (0.5 * door.k_c * (f + shut) + door.tau_c0_prime)
    return 0.5 * door.i_a * omega**2 + spring


@given(door=doors, angle=st.floats(0.03, 1.2))
def test_what_leaf_and_spring_lose_is_heat_in_damper_and_hinge(door: Door, angle: float) -> None:
    """For any closer, zones and friction, to 0.2 % of the energy in samples of 1 ms."""
    swing = simulate(door, 0.0, initial_velocity(door, angle), 6.0, stop=True)
    viscosity = door.viscosity(swing.theta, np.sign(swing.omega))
    damper = viscosity * (door.closer.eta(swing.theta) * swing.omega) ** 2
    heat = cumulative_trapezoid(damper, swing.t, initial=0.0) + door.friction * np.concatenate(
        [[0.0], np.cumsum(np.abs(np.diff(swing.theta)))])
    energy = energy_of(door, swing.theta, swing.omega)
    np.testing.assert_allclose(energy + heat, energy[0], atol=2e-3 * energy[0])


def test_friction_turns_its_torque_times_the_way_into_heat() -> None:
    """Without a damper a swing to 0.4 rad and back loses 2 N m times 0.8 rad."""
    door = replace(PAPER, c_c=0.0, friction=2.0)
    swing = simulate(door, 0.0, initial_velocity(door, 0.4), 10.0, stop=True)
    energy = energy_of(door, swing.theta, swing.omega)
    assert energy[0] - energy[-1] == pytest.approx(2.0 * 0.8, abs=1e-6)


def test_a_door_that_friction_holds_as_soon_as_it_turns_round_is_held() -> None:
    """The pull exceeds the friction by rounding alone where the door turns; the motion goes on."""
    door = replace(PAPER, c_c=0.0, k_c=1.0, tau_c0_prime=8.0, friction=2.75)
    swing = simulate(door, 0.75, 0.1, 1.0, stop=True,
                     torque=lambda t: 1.5 * door.i_a * math.sin(2.375 * t))
    assert swing.t[-1] == pytest.approx(1.0)
