"""The contact's detection from the trunk's accelerometer, the feet's force and the door."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from motion_execution.hit.contact import ContactDetector, Sensor
from motion_execution.settings import ExecutionSettings

TICK = 0.005  # period of the driver [s]
AWAY = np.array([0.0, 1.0, 0.0])  # direction away from the door in the IMU's frame
QUIET = np.array([0.02, -0.06, 9.8])  # reading in the run-up [m/s^2]
LEAST = ExecutionSettings().contact_deceleration
HITS = {
    # Readings away from the door from the first tick with a force on, recorded in the simulation
    # on gears that give: angle [deg], factor on the gears' stiffness, friction of the leaf, and
    # the time from the begin of the contact to the first of the readings [ms].
    (15, 1.0, 0.0, 0): (0.9, 23.7, 28.6, 10.9, -6.2),
    (15, 0.5, 0.6, 2): (16.1, 18.3, 15.9, 3.3, -1.8),
    (25, 1.0, 0.0, 4): (23.7, 35.7, 18.8, -5.3, -12.9),
    (30, 2.0, 0.6, 4): (33.3, 25.0, 12.1, -2.7, -13.8),
}


def detector(readings: int = 40) -> tuple[ContactDetector, float]:
    """A detector in the middle of a quiet run-up, and the stamp of its last reading."""
    made, now = ContactDetector(ExecutionSettings(), AWAY), 0.0
    for number in range(readings):
        now = number * TICK
        assert made.on_imu(now, QUIET) is None
    return made, now


@pytest.mark.parametrize(("case", "readings"), HITS.items(), ids=str)
def test_a_recorded_hit_is_detected_within_12_ms_and_its_begin_within_3(case, readings) -> None:
    made, now = detector()
    begin = now + TICK - 1e-3 * case[-1]
    for number, away in enumerate(readings, 1):
        found = made.on_imu(now + number * TICK, QUIET + away * AWAY)
        if found is not None:
            break
    assert found is not None
    assert found.sensor is Sensor.IMU
    assert found.shown - begin <= 0.012
    assert found.begin == pytest.approx(begin, abs=0.003)


@given(away=st.floats(-1e3, 1e3), across=st.floats(-1e3, 1e3), up=st.floats(-1e3, 1e3))
def test_a_single_reading_is_no_contact_whatever_it_says(away, across, up) -> None:
    made, now = detector()
    odd = np.array([across, away, up])
    assert made.on_imu(now + TICK, QUIET + odd) is None
    for number in range(2, 30):
        assert made.on_imu(now + number * TICK, QUIET) is None


@given(st.lists(st.floats(-0.49 * LEAST, 0.49 * LEAST), min_size=20, max_size=60))
def test_readings_that_vary_by_less_than_the_threshold_are_no_contact(values) -> None:
    made, now = detector()
    for number, away in enumerate(values, 1):
        assert made.on_imu(now + number * TICK, QUIET + away * AWAY) is None


@given(tilt=st.floats(-0.5, 0.5), bias=st.floats(-1.0, 1.0))
def test_neither_a_lean_of_the_trunk_nor_a_bias_matters(tilt, bias) -> None:
    """What counts is the difference from the readings before."""
    constant = 9.8 * np.array([0.0, np.sin(tilt), np.cos(tilt)]) + bias
    for extra, expected in ((0.9 * LEAST, False), (1.1 * LEAST, True)):
        made = ContactDetector(ExecutionSettings(), AWAY)
        found = [made.on_imu(number * TICK, constant + (extra * AWAY if number > 38 else 0.0))
                 for number in range(41)]
        assert not any(found[:-1])
        assert (found[-1] is not None) == expected


@pytest.mark.parametrize("direction", [-AWAY, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], ids=str)
def test_a_push_towards_the_door_or_across_is_no_contact(direction) -> None:
    made, now = detector()
    for number in range(1, 10):
        assert made.on_imu(now + number * TICK, QUIET + 30.0 * np.array(direction)) is None


def test_without_enough_readings_before_it_a_reading_shows_nothing() -> None:
    """After a pause of the IMU, too: what it shows then may be another posture."""
    made = ContactDetector(ExecutionSettings(), AWAY)
    assert made.on_imu(0.0, QUIET) is None
    assert made.on_imu(TICK, QUIET + 30.0 * AWAY) is None
    assert made.on_imu(2 * TICK, QUIET + 30.0 * AWAY) is None

    made, now = detector()
    for number in range(6):
        assert made.on_imu(now + 0.1 + number * TICK, QUIET + 30.0 * AWAY) is None


@pytest.mark.parametrize("start", [0.0, 0.1, 17.3, 1e4 / 3.0])
def test_readings_that_are_lost_before_or_in_the_hit_only_delay_the_decision(start) -> None:
    """Whatever the clock's rounding: 20 ms may pass between two readings."""
    made = ContactDetector(ExecutionSettings(), AWAY)
    for number in range(20):
        assert made.on_imu(start + number * TICK, QUIET) is None
    now = start + 19 * TICK
    assert made.on_imu(now + 4 * TICK, QUIET) is None
    assert made.on_imu(now + 5 * TICK, QUIET + 20.0 * AWAY) is None
    found = made.on_imu(now + 7 * TICK, QUIET + 20.0 * AWAY)
    assert found.begin == pytest.approx(now + 4 * TICK, abs=TICK)


def test_the_feet_and_the_door_show_a_contact_alone() -> None:
    made = ContactDetector(ExecutionSettings(), AWAY)
    assert made.on_feet(1.0, 0.99 * ExecutionSettings().felt_force) is None
    assert made.on_feet(1.0, np.nan) is None
    found = made.on_feet(1.0, ExecutionSettings().felt_force)
    assert (found.sensor, found.shown) == (Sensor.FEET, 1.0)
    assert found.begin == pytest.approx(1.0 - ExecutionSettings().force_delay)
    assert made.on_door(1.0, ExecutionSettings().door_moves) is None
    found = made.on_door(1.0, 1.01 * ExecutionSettings().door_moves)
    assert (found.sensor, found.begin, found.shown) == (Sensor.DOOR, 1.0, 1.0)
