"""The watch over leaf and hand ends a passage only if a limit is exceeded for some time."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from walking.passing.watch import Watch, WatchSettings

TICK = 0.01
LIMITS = WatchSettings()


def opening(time: np.ndarray) -> np.ndarray:
    """A leaf that opens by 10 deg/s."""
    return np.radians(10.0) * time


def run(watch: Watch, error_deg: float, begin: float, end: float) -> list[str]:
    """What the watch says while the leaf is off its plan by an angle."""
    return [watch.on_door(float(t), float(opening(t)) + math.radians(error_deg))
            for t in np.arange(begin, end, TICK)]


@given(error=st.floats(-7.9, 7.9))
def test_a_leaf_within_8_deg_of_the_plan_is_held(error: float) -> None:
    watch = Watch(opening)
    assert not any(run(watch, error, 0.0, 3.5))
    assert watch.largest_error == pytest.approx(math.radians(abs(error)), abs=1e-9)


@pytest.mark.parametrize(("error", "where"), [(9.0, "ahead of"), (-9.0, "behind")])
def test_a_leaf_off_the_plan_for_0_2_s_is_lost_unless_it_comes_back_in_time(error, where):
    watch = Watch(opening)
    assert not any(run(watch, error, 1.0, 1.19) + run(watch, 0.0, 1.19, 1.2))
    said = run(watch, error, 1.2, 1.7)
    first = next(number for number, text in enumerate(said) if text)
    assert first * TICK == pytest.approx(LIMITS.leaf_time, abs=1.5 * TICK)
    assert f"9.0 deg {where} the plan" in said[first]


def test_the_force_is_a_mean_over_20_ms() -> None:
    watch = Watch(opening)
    for number, force in enumerate([40.0, 80.0, 120.0, 160.0, 0.0]):
        watch.on_hand(0.005 * number, force)
    assert watch.largest_force == pytest.approx(100.0)


@pytest.mark.parametrize(("force", "time", "stops"), [
    (149.0, 1.0, False), (400.0, 0.08, False), (151.0, 0.15, True)])
def test_a_large_force_stops_the_robot_when_it_lasts(force, time, stops) -> None:
    watch = Watch(opening)
    assert any(watch.on_hand(float(t), force) for t in np.arange(0.0, time, 0.005)) is stops
