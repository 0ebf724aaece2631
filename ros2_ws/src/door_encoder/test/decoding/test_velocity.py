"""Estimated velocity compared with the true one: steady, swinging, hit, stopped; and its delay."""

import math

import numpy as np
import pytest
from door_encoder.decoding.velocity import ENOUGH, LONGEST, Velocity, VelocityEstimator
from hypothesis import given
from hypothesis import strategies as st

COUNT = 2.0 * math.pi / 14400
PERIOD = 1e-3
WINDOW = 50
SHORTEST_DELAY = 0.5 * (WINDOW - 1) * PERIOD
FAST = 7.5 / (WINDOW * PERIOD) * COUNT  # no slope of a longer window is above this
EXECUTOR_CONTACT = 0.15  # [rad/s] on /door_angle that tells impact_executor of the hit


def estimator() -> VelocityEstimator:
    """Return an estimator with the settings of the node."""
    return VelocityEstimator(period=PERIOD, window=WINDOW, radians_per_count=COUNT)


def velocities(theta: np.ndarray, every: int = 10) -> list[tuple[int, Velocity]]:
    """Return index and estimated velocity of samples of an encoder, for angles (N,) [rad]."""
    counts = np.floor(theta / COUNT).astype(np.int64)
    made = estimator()
    found = []
    for start in range(0, len(counts), every):
        made.take(counts[start : start + every])
        found.append((min(start + every, len(counts)) - 1, made.velocity()))
    return found


def fixed_window(theta: np.ndarray, newest: int) -> float:
    """Return the slope of the quantised angles over the shortest window, worked out differently."""
    counts = np.floor(theta / COUNT)[newest - WINDOW + 1 : newest + 1]
    return float(np.polyfit(np.arange(WINDOW) * PERIOD, counts * COUNT, 1)[0])


@given(
    speed=st.sampled_from([0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.3, 1.0, 2.0]),
    sign=st.sampled_from([-1.0, 1.0]),
    phase=st.floats(0.0, 1.0),
)
def test_steady_speeds_from_half_a_milliradian_a_second(
    speed: float, sign: float, phase: float
) -> None:
    """The error is 7 % if a second has 5 counts, else 1.5 counts per second."""
    theta = sign * (speed * np.arange(2000) * PERIOD + phase * COUNT)
    limit = 0.07 * speed if speed >= ENOUGH * COUNT / LONGEST else 1.5 * COUNT / LONGEST
    for newest, found in velocities(theta):
        if newest > 1.1 * LONGEST / PERIOD:
            assert found.omega == pytest.approx(sign * speed, abs=limit)
            assert found.delay <= max(SHORTEST_DELAY, 3.0 * COUNT / speed)
            assert found.delay <= 0.5 * LONGEST


@given(
    amplitude=st.floats(0.002, 0.5),
    frequency=st.floats(0.1, 1.0),
    phase=st.floats(0.0, 2.0 * math.pi),
)
def test_a_swinging_door_is_that_of_the_stated_time(
    amplitude: float, frequency: float, phase: float
) -> None:
    """A sine's velocity at the stated time is right except for quantisation and averaging."""
    w = 2.0 * math.pi * frequency
    t = np.arange(4000) * PERIOD
    theta = amplitude * np.sin(w * t + phase)
    for newest, found in velocities(theta):
        if newest < 1.1 * LONGEST / PERIOD:
            continue
        truth = amplitude * w * math.cos(w * (t[newest] - found.delay) + phase)
        window = 2.0 * found.delay + PERIOD
        rounding = min(amplitude * w**3 * window**2 / 24.0, 2.0 * amplitude / window)
        assert abs(found.omega - truth) <= 1.5 * COUNT / window + rounding


@given(
    speed=st.floats(0.16, 3.0),
    rise=st.integers(0, 30),
    rest=st.integers(60, 1500),
    phase=st.floats(0.0, 1.0),
)
def test_a_hit_is_seen_as_soon_as_by_the_shortest_window(
    speed: float, rise: int, rest: int, phase: float
) -> None:
    """Above 0.065 rad/s the velocity is that of the shortest window alone."""
    omega = np.concatenate([np.zeros(rest), speed * np.arange(rise) / max(rise, 1), [speed] * 90])
    theta = phase * COUNT + np.cumsum(omega) * PERIOD
    assert FAST < 0.5 * EXECUTOR_CONTACT
    for newest, found in velocities(theta):
        if newest < WINDOW:
            continue
        reference = fixed_window(theta, newest)
        if reference > 1.001 * FAST:
            assert found.omega == pytest.approx(reference, rel=1e-9)
            assert found.delay == pytest.approx(SHORTEST_DELAY)
        else:
            assert found.omega < EXECUTOR_CONTACT


@given(speed=st.floats(0.05, 2.0), phase=st.floats(0.0, 1.0))
def test_a_door_that_stopped_is_no_faster_than_a_count_since(speed: float, phase: float) -> None:
    """After a stop the speed is at most a count in the time since then, and 0 after a second."""
    moving = 300
    t = np.minimum(np.arange(2000), moving) * PERIOD
    for newest, found in velocities(phase * COUNT + speed * t):
        since = (newest - moving) * PERIOD
        if since > WINDOW * PERIOD:
            assert abs(found.omega) <= COUNT / since * 1.001
        if since > LONGEST:
            assert found.omega == 0.0


@given(flicker=st.lists(st.integers(0, 1), min_size=200, max_size=200))
def test_a_flickering_count_is_no_motion(flicker: list[int]) -> None:
    """A resting door whose count flickers stays far below the speed of a contact."""
    for newest, found in velocities((np.array(flicker) + 0.5) * COUNT, every=7):
        assert abs(found.omega) <= 1.5 * COUNT / (max(WINDOW, newest) * PERIOD)


def test_an_accelerating_door_lags_by_the_stated_delay() -> None:
    """The slope of a parabola is that in the middle of the window."""
    t = np.arange(200) * PERIOD
    newest, found = velocities(0.5 * 8.0 * t**2)[-1]
    assert found.omega == pytest.approx(8.0 * (t[newest] - found.delay), rel=2e-3)
    assert found.delay == pytest.approx(SHORTEST_DELAY)
