"""Angles at 100 Hz, and the estimated velocity compared with the true one."""

import math

import numpy as np
import pytest
from door_encoder.decoding.angle import ENOUGH, LONGEST, AnglePoint, AngleSampler
from door_model.recording.batch import SampleBatch
from hypothesis import given
from hypothesis import strategies as st

COUNT = 2.0 * math.pi / 14400
PERIOD = 1e-3
WINDOW = 50
SHORTEST_DELAY = 0.5 * (WINDOW - 1) * PERIOD
FAST = 7.5 / (WINDOW * PERIOD) * COUNT  # no slope of a longer window is above this
EXECUTOR_CONTACT = 0.15  # [rad/s] on /door_angle that tells motion_server of the hit


def batch(first: int, counts: np.ndarray, gap: bool = False) -> SampleBatch:
    """Return a batch at 1 kHz whose stamp follows from its number."""
    return SampleBatch(first * 10**6, PERIOD, first, 14400, counts, gap)


def velocities(theta: np.ndarray) -> list[tuple[int, AnglePoint]]:
    """Return sample and point at 100 Hz of an encoder, for angles (N,) [rad]."""
    sampler = AngleSampler(radians_per_count=COUNT)
    points = sampler.take(batch(0, np.floor(theta / COUNT).astype(np.int64)))
    return [(point.stamp_ns // 10**6, point) for point in points]


@given(sizes=st.lists(st.integers(1, 70), min_size=1, max_size=15))
def test_angle_comes_at_100_hz_whatever_the_batches(sizes: list[int]) -> None:
    """Every tenth sample gives a point with its stamp, its angle and the slope up to it."""
    sampler, points, first = AngleSampler(radians_per_count=1e-3), list[AnglePoint](), 0
    for size in sizes:
        points += sampler.take(batch(first, np.arange(first, first + size)))
        first += size
    assert [point.stamp_ns for point in points] == [n * 10**6 for n in range(0, first, 10)]
    for point in points:
        assert point.theta == pytest.approx(point.stamp_ns * 1e-9)
        assert point.omega == pytest.approx(1.0 if point.stamp_ns else 0.0)


@given(missing=st.integers(1, 10), speed=st.sampled_from([0, 1, 5]))
def test_velocity_goes_on_across_a_few_lost_samples(missing: int, speed: int) -> None:
    """A missed poll or a single garbage sample does not change the velocity of a steady door."""
    sampler = AngleSampler(radians_per_count=1e-3)
    counts, first = speed * np.arange(300), 100 + missing
    points = [*sampler.take(batch(0, counts[:100])),
              *sampler.take(batch(first, counts[first:], gap=True))]
    assert all(point.omega == pytest.approx(speed) for point in points[1:])


@given(speed=st.sampled_from([0.0005, 0.001, 0.002, 0.005, 0.01, 0.05, 0.1, 0.3, 1.0, 2.0]),
       sign=st.sampled_from([-1.0, 1.0]), phase=st.floats(0.0, 1.0))
def test_steady_speeds_from_half_a_milliradian_a_second(
        speed: float, sign: float, phase: float) -> None:
    """The error is 7 % if a second has 5 counts, else 1.5 counts per second."""
    theta = sign * (speed * np.arange(2000) * PERIOD + phase * COUNT)
    limit = 0.07 * speed if speed >= ENOUGH * COUNT / LONGEST else 1.5 * COUNT / LONGEST
    for newest, found in velocities(theta):
        if newest > 1.1 * LONGEST / PERIOD:
            assert found.omega == pytest.approx(sign * speed, abs=limit)
            assert found.delay <= max(SHORTEST_DELAY, 3.0 * COUNT / speed)
            assert found.delay <= 0.5 * LONGEST


@given(amplitude=st.floats(0.002, 0.5), frequency=st.floats(0.1, 1.0),
       phase=st.floats(0.0, 2.0 * math.pi))
def test_a_swinging_door_is_that_of_the_stated_time(
        amplitude: float, frequency: float, phase: float) -> None:
    """A sine's velocity at the stated time is right except for quantisation and averaging."""
    w = 2.0 * math.pi * frequency
    t = np.arange(4000) * PERIOD
    for newest, found in velocities(amplitude * np.sin(w * t + phase)):
        if newest < 1.1 * LONGEST / PERIOD:
            continue
        truth = amplitude * w * math.cos(w * (t[newest] - found.delay) + phase)
        window = 2.0 * found.delay + PERIOD
        rounding = min(amplitude * w**3 * window**2 / 24.0, 2.0 * amplitude / window)
        assert abs(found.omega - truth) <= 1.5 * COUNT / window + rounding


@given(speed=st.floats(0.16, 3.0), rise=st.integers(0, 30), rest=st.integers(60, 1500),
       phase=st.floats(0.0, 1.0))
def test_a_hit_is_seen_as_soon_as_by_the_shortest_window(
        speed: float, rise: int, rest: int, phase: float) -> None:
    """Above 0.065 rad/s the velocity is that of the shortest window alone."""
    omega = np.concatenate([np.zeros(rest), speed * np.arange(rise) / max(rise, 1), [speed] * 90])
    theta = phase * COUNT + np.cumsum(omega) * PERIOD
    assert FAST < 0.5 * EXECUTOR_CONTACT
    for newest, found in velocities(theta):
        if newest < WINDOW:
            continue
        seen = np.floor(theta / COUNT)[newest - WINDOW + 1 : newest + 1] * COUNT
        reference = float(np.polyfit(np.arange(WINDOW) * PERIOD, seen, 1)[0])
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
    for newest, found in velocities((np.array(flicker) + 0.5) * COUNT):
        assert abs(found.omega) <= 1.5 * COUNT / (max(WINDOW, newest) * PERIOD)
