"""Free motion of many doors at once, and its derivatives."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest
from door_model.door.closer import FourBarCloser, angle_limits, four_bar
from door_model.door.door import Door, Zone
from door_model.door.ratios import Ratios
from door_model.errors import DoorModelError
from door_model.motion.dynamics import follow_free, simulate
from door_model.motion.free_motion import UNKNOWNS, End, follow
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

CLOSER = FourBarCloser(0.195, 0.204, 0.220, 0.265, 0.34)
PAPER = Door(12.75, 0.06, 1.13, 3.2, CLOSER)
REAL = replace(  # a closer as one finds them
    PAPER, c_c_closing=0.5, backcheck=Zone(math.radians(18.0), 0.15),
    latch=Zone(math.radians(8.0), 0.2), friction=0.4)


def random_doors(count: int) -> tuple[NDArray[np.float64], Ratios, NDArray[np.float64]]:
    """Return linkages (6, K), ratios and speeds of doors that open and are pulled back."""
    rng = np.random.default_rng(5)
    links, rows, speeds = [], [], []
    while len(links) < count:
        link = (*rng.uniform(0.1, 0.4, 4), rng.uniform(0.15, 1.0), 1)
        low, high = angle_limits(*link[:5])
        if not (low < -0.01 and high > 0.6):
            continue
        damping, closing = rng.uniform(0.0, 0.5), rng.uniform(0.1, 10.0)
        spring, preload = rng.uniform(0.1, 5.0), rng.uniform(2.0, 12.0)
        f, eta, _ = four_bar(np.linspace(0.0, min(high - 0.02, 1.5), 50), *link)
        if not (eta * (spring * f + preload) > 0.3).all():
            continue
        ratios = np.array([damping, closing, damping, closing, spring, preload])
        ratios /= rng.uniform(3.0, 60.0)
        speed = rng.uniform(0.2, 1.2)
        if follow(link, Ratios(*ratios), 0.0, speed, until=60.0, to_peak=True).end == End.LINKAGE:
            continue
        links.append(link)
        rows.append(ratios)
        speeds.append(speed)
    return np.array(links).T, Ratios(*np.array(rows).T), np.array(speeds)


def test_peaks_of_20_random_closers() -> None:
    """Peaks agree to 1e-4 deg and 1e-3 s with scipy at rtol 1e-10."""
    link, ratios, speeds = random_doors(20)
    table = ratios.table(20)
    motion = follow(link, ratios, 0.0, speeds, until=60.0, to_peak=True)
    for k, speed in enumerate(speeds):
        damping, spring, preload = table[[0, 4, 5], k]

        def slope(_t: float, x: NDArray[np.float64], k: int = k,
                  law: tuple[float, ...] = (damping, spring, preload)) -> tuple[float, float]:
            f, eta, _ = four_bar(x[0], *link[:, k])
            return x[1], -eta * (law[0] * eta * x[1] + law[1] * f + law[2])

        def top(_t: float, x: NDArray[np.float64]) -> float:
            return float(x[1])

        top.terminal = True  # type: ignore[attr-defined]
        exact = solve_ivp(slope, (0.0, 60.0), (0.0, speed), rtol=1e-10, atol=1e-12, events=top)
        assert math.degrees(abs(motion.peak_angle[k] - exact.y[0, -1])) < 1e-4
        assert abs(motion.peak_time[k] - exact.t[-1]) < 1e-3


@pytest.mark.parametrize("door", [PAPER, REAL])
def test_a_swing_through_zones_and_back_agrees_with_scipy(door: Door) -> None:
    """Angles, speeds and the time of closing are those of `solve_ivp` over eqs. (1) to (13)."""

    def slope(_t: float, x: NDArray[np.float64]) -> tuple[float, float]:
        torque = door.restoring_torque(x[0]) + door.damping_torque(x[0], x[1])
        return x[1], -float(torque + door.friction * np.sign(x[1])) / door.i_a

    def shut(_t: float, x: NDArray[np.float64]) -> float:
        return float(x[0])

    shut.terminal = True  # type: ignore[attr-defined]
    swing = solve_ivp(slope, (0.0, 20.0), (0.01, 0.9), rtol=1e-9, atol=1e-9, events=shut)
    motion = follow_free(door, 0.01, 0.9)
    theta, speed = motion.at(swing.t[:-1])
    assert np.abs(theta[:, 0] - swing.y[0, :-1]).max() < 1e-6
    assert np.abs(speed[:, 0] - swing.y[1, :-1]).max() < 1e-5
    assert motion.end[0] == End.SHUT
    assert motion.end_time[0] == pytest.approx(swing.t[-1], abs=1e-6)


@pytest.mark.parametrize("unknown", UNKNOWNS)
def test_derivatives_are_those_of_the_motion(unknown: str) -> None:
    """Derivatives through backcheck, turn and latch zone agree with differences."""
    ratios = REAL.ratios()
    start = {field.name: float(getattr(ratios, field.name)) for field in fields(Ratios)}
    start |= {"theta0": 0.02, "omega0": 0.7}
    times = np.linspace(0.0, 4.5, 150)

    def motion(change: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        values = start | {unknown: start[unknown] + change}
        theta0, omega0 = values.pop("theta0"), values.pop("omega0")
        return follow(
            CLOSER.numbers(), Ratios(**values), theta0, omega0, until=5.0, exact=True
        ).derivatives(0, times)

    step = 1e-5
    slopes = motion(0.0)[1][:, UNKNOWNS.index(unknown)]
    differences = (motion(step)[0] - motion(-step)[0]) / (2.0 * step)
    assert np.abs(differences).max() > 1e-3
    np.testing.assert_allclose(slopes, differences, atol=1e-5 * np.abs(differences).max())


def test_friction_holds_a_door_that_is_pulled_less_until_it_is_pushed() -> None:
    """It stays where it has turned round, and moves when it is pushed from 0.5 s."""
    door = replace(PAPER, friction=1.01 * float(PAPER.restoring_torque(0.3)))
    motion = follow_free(door, 0.29, 0.2)
    assert motion.end[0] == End.STUCK
    assert motion.at(np.array([50.0]))[0][0, 0] == motion.peak_angle[0]
    assert simulate(door, 0.29, 0.2, 2.0).theta[-1] == pytest.approx(
        motion.peak_angle[0], abs=1e-9)
    held = replace(PAPER, friction=6.0)
    swing = simulate(held, 0.5, 0.0, 1.0, torque=lambda t: 0.0 if t < 0.5 else 30.0)
    assert (swing.theta[swing.t < 0.5] == 0.5).all()
    assert swing.theta[-1] > 0.6


def test_parameters_that_are_no_numbers_end() -> None:
    """NaN among the ratios causes an error, never an endless motion."""
    with pytest.raises(DoorModelError, match="not a number"):
        follow(CLOSER.numbers(), replace(PAPER.ratios(), spring=math.nan), 0.0, 0.5, until=5.0)
