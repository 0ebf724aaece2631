"""Dynamics of the door, eqs. (1), (12), (13) and section II.C.2."""

import math

import numpy as np
import pytest
from door_model.door.closer import FourBarCloser
from door_model.door.config import load_door
from door_model.door.door import Door
from door_model.errors import (
    DoorModelError,
    DoorParameterError,
    LinkageError,
    UnreachableAngleError,
)
from door_model.motion.dynamics import initial_velocity, simulate
from hypothesis import given
from hypothesis import strategies as st

CLOSER = FourBarCloser(0.195, 0.204, 0.220, 0.265, 0.34)
doors = st.builds(
    Door, i_a=st.floats(2.0, 60.0), c_c=st.floats(0.0, 0.5), k_c=st.floats(0.1, 5.0),
    tau_c0_prime=st.floats(2.0, 15.0), closer=st.just(CLOSER))


@pytest.mark.parametrize(("tau", "omega"), [(4.0, 0.707), (6.0, 0.862), (3.2, 0.635)])
def test_initial_velocity_for_25_degrees(tau: float, omega: float) -> None:
    """The paper's door needs the known velocities."""
    door = Door(12.75, 0.06, 1.13, tau, CLOSER)
    assert initial_velocity(door, math.radians(25.0)) == pytest.approx(omega, abs=6e-4)


@given(door=doors, factor=st.floats(0.1, 10.0))
def test_one_factor_on_all_parameters_changes_nothing(door: Door, factor: float) -> None:
    """A common factor of I_A, c_c, k_c and tau'_c0 does not change free motion."""
    scaled = Door(
        factor * door.i_a, factor * door.c_c, factor * door.k_c, factor * door.tau_c0_prime, CLOSER
    )
    a, b = (simulate(d, 0.1, 0.5, 0.4, period=0.01, stop=True) for d in (door, scaled))
    np.testing.assert_allclose(a.theta, b.theta, atol=1e-8)


def test_restoring_torque_falls_as_the_door_opens() -> None:
    """The restoring torque is largest at the closed door, as in Fig. 16."""
    door = Door(12.75, 0.06, 1.13, 6.0, CLOSER)
    torque = door.restoring_torque(np.radians([0.0, 10.0, 25.0]))
    assert torque[0] == pytest.approx(18.07, abs=0.02)
    assert (np.diff(torque) < 0.0).all()


def test_external_torque_does_work() -> None:
    """A short strong push transfers its impulse to the door."""
    door = load_door("paper").door()
    swing = simulate(door, 0.3, 0.0, 1e-3, period=1e-4, torque=lambda _t: 5000.0)
    assert swing.omega[-1] == pytest.approx(5.0 / door.i_a, rel=0.01)


@pytest.mark.parametrize(("angle", "start", "error"), [
    (math.nan, 0.0, DoorParameterError), (0.2, 0.2, DoorParameterError),
    (0.2, -0.01, DoorParameterError), (math.radians(170.0), 0.0, LinkageError)])
def test_angles_that_make_no_sense(
    angle: float, start: float, error: type[DoorModelError]
) -> None:
    """Negative, NaN and unreachable angles, and angles not above the start, are errors."""
    with pytest.raises(error):
        initial_velocity(load_door("paper").door(), angle, start)


def test_door_that_pulls_nowhere() -> None:
    """A closer that does not pull the door back causes an error, not an endless search."""
    slack = Door(12.75, 0.0, 1.0, -2.0, CLOSER)
    with pytest.raises(UnreachableAngleError, match="does not pull"):
        initial_velocity(slack, 0.4)
    # Pushed out near the closed door, pulled in further out: rest at 1.6 rad is above the start's
    # potential, rest just behind the equilibrium is below it.
    humped = Door(12.75, 0.0, 4.0, -2.0, CLOSER)
    with pytest.raises(UnreachableAngleError, match="no start"):
        initial_velocity(humped, 0.55)


def test_door_refuses_nan() -> None:
    """Every parameter must be a number."""
    with pytest.raises(DoorParameterError, match="k_c"):
        Door(12.75, 0.06, math.nan, 3.2, CLOSER)
