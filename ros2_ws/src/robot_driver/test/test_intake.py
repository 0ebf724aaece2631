"""The present time between two messages on /clock."""

import math

import pytest
from robot_driver.intake import CURRENT, present


@pytest.mark.parametrize(("stamps", "expected"), [
    ((), 10.0), ((9.9,), 10.0), ((10.01, 10.005), 10.01), ((10.0 + 2.0 * CURRENT,), 10.0),
    ((math.inf, 10.02), 10.02)])
def test_the_newest_stamp_that_the_clock_allows_tells_the_time(
        stamps: tuple[float, ...], expected: float) -> None:
    """One far ahead is of before a reset, or wrong; the clock's time is 10 s."""
    assert present(10.0, *stamps) == expected
