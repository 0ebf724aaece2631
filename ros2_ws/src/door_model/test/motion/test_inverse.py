"""w' for an angle and the angle for a w', section II.C.2: numbers, arrays and dead centres."""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from door_model.door.closer import FourBarCloser
from door_model.door.config import WORKING_RANGE, load_door
from door_model.door.door import Door, Zone
from door_model.errors import (
    ConfigError,
    DeadCentreError,
    DoorModelError,
    LinkageError,
    UnreachableAngleError,
)
from door_model.motion.dynamics import initial_velocity, peak
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

CLOSER = FourBarCloser(0.195, 0.204, 0.220, 0.265, 0.34)
PAPER = Door(12.75, 0.06, 1.13, 3.2, CLOSER)
MIRRORED = replace(CLOSER, assembly=-1)
DEAD_CENTRE = math.radians(66.7370928524)  # of MIRRORED
# Shut by a spring that pulls the other way: 9 N m at the closed door, none at the dead centre.
TURNING = Door(12.75, 0.06, 0.5, 9.0 / MIRRORED.eta(0.0) - 0.5 * MIRRORED.f(0.0), MIRRORED)

FILTERING = [HealthCheck.filter_too_much]  # most random links are no door

lengths = st.floats(0.12, 0.4)
viscosities = st.floats(0.0, 0.6)
zones = st.none() | st.builds(Zone, st.floats(0.05, 1.2), viscosities)


@st.composite
def doors(draw: Callable[..., Any]) -> Door:
    """Draw doors of any linkage and mode that are pulled shut when they are closed."""
    closer = FourBarCloser(
        *(draw(lengths) for _ in range(4)), draw(st.floats(0.1, 1.2)),
        draw(st.sampled_from([1, -1])))
    try:
        eta, f = closer.eta(0.0), closer.f(0.0)
        assume(closer.closing_limit() < -0.02 and closer.opening_limit() > 0.2)
    except LinkageError:
        assume(False)
    assume(abs(eta) > 0.05)
    k_c = draw(st.floats(0.1, 4.0))
    tau = draw(st.floats(2.0, 25.0)) / eta - k_c * f
    return Door(
        draw(st.floats(3.0, 60.0)), draw(viscosities), k_c, tau, closer,
        draw(st.none() | viscosities), draw(zones), draw(zones), draw(st.floats(0.0, 2.0)))


def reachable(door: Door, share: float) -> float:
    """Draw an angle within the linkage at which the door is held or clearly pulled back."""
    angle = share * min(door.closer.opening_limit() - 0.02, 2.0)
    assume(angle > 0.02)
    assume(door.restoring_torque(angle) + door.friction > 0.2)
    return angle


@settings(suppress_health_check=FILTERING)
@given(door=doors(), share=st.floats(0.02, 1.0), start=st.floats(0.0, 0.97))
def test_peak_undoes_initial_velocity(door: Door, share: float, start: float) -> None:
    """With its w' any door turns round at the wanted angle, from any start."""
    angle = reachable(door, share)
    theta0 = start * angle
    try:
        omega = initial_velocity(door, angle, theta0)
    except UnreachableAngleError:  # only where something on the way throws the door open
        way = door.restoring_torque(np.linspace(theta0, angle, 200)) + door.friction
        assert way.min() < 0.05
        assume(False)
    assert isinstance(omega, float)
    summit = peak(door, theta0, omega)
    assert summit.angle == pytest.approx(angle, abs=1e-6)
    assert summit.time > 0.0


@given(before=st.floats(-9.0, -1.5), start=st.floats(0.0, 0.29), c_c=st.floats(0.0, 5.0))
def test_a_zone_that_begins_just_before_the_turn(before: float, start: float, c_c: float) -> None:
    """A backcheck just before the turn is neither missed nor met on the way back."""
    angle = 0.3 + 10.0**before
    door = replace(PAPER, backcheck=Zone(0.3, c_c))
    omega = initial_velocity(door, angle, start)
    assert peak(door, start, omega).angle == pytest.approx(angle, abs=1e-8)


@settings(suppress_health_check=FILTERING)
@given(door=doors(), shares=st.lists(st.floats(0.02, 1.0), min_size=1, max_size=4))
def test_arrays_are_the_numbers_one_by_one(door: Door, shares: list[float]) -> None:
    """Angles (K, 1) and starts (3,) give (K, 3) values equal to those of single numbers."""
    angles = np.array([[reachable(door, share)] for share in shares])
    starts = np.array([0.0, 0.3, 0.9]) * angles.min()
    try:
        omegas = initial_velocity(door, angles, starts)
    except UnreachableAngleError:
        assume(False)
    summits = peak(door, starts, omegas)
    assert omegas.shape == summits.angle.shape == summits.time.shape == (len(shares), 3)
    for row, column in np.ndindex(omegas.shape):
        alone = initial_velocity(door, float(angles[row, 0]), float(starts[column]))
        assert omegas[row, column] == pytest.approx(alone, rel=1e-9)
        summit = peak(door, float(starts[column]), alone)
        assert summits.time[row, column] == pytest.approx(summit.time, abs=1e-6)
        assert summits.angle[row, column] == pytest.approx(summit.angle, abs=1e-6)


@pytest.mark.parametrize(("ask", "match"), [
    (lambda: initial_velocity(PAPER, [0.3, math.nan]), r"angle \(element \[1\]\)"),
    (lambda: peak(PAPER, [0.1, 0.2], [[0.4], [40.0]]), r"element \[1, 0\]")])
def test_the_element_that_failed_is_named(ask: Callable[[], Any], match: str) -> None:
    """An error about an array names the element and its value."""
    with pytest.raises(DoorModelError, match=match):
        ask()


@given(angle=st.floats(DEAD_CENTRE + 1e-6, 2.7), share=st.floats(0.0, 0.99))
def test_no_velocity_leads_to_rest_beyond_a_dead_centre(angle: float, share: float) -> None:
    """For an angle beyond a dead centre the error names link and angle, whatever the start."""
    assert TURNING.dead_centre() == pytest.approx(DEAD_CENTRE, abs=1e-9)
    with pytest.raises(DeadCentreError, match=r"66\.74 deg: link l3") as caught:
        initial_velocity(TURNING, [0.5, angle], [0.0, share * angle])
    assert caught.value.limit == pytest.approx(DEAD_CENTRE, abs=1e-9)
    assert caught.value.value == pytest.approx(angle)
    assert "(element [1])" in str(caught.value)


def test_every_velocity_ends_before_the_dead_centre_or_in_its_error() -> None:
    """The fastest door that turns round does so just before the dead centre."""
    omega = initial_velocity(TURNING, DEAD_CENTRE - 1e-3)
    assert (peak(TURNING, 0.0, omega * np.linspace(0.01, 1.0, 200)).angle < DEAD_CENTRE).all()
    for start, speed in ((0.0, 1.01 * omega), (0.0, 3.0 * omega), (DEAD_CENTRE + 0.2, 0.01)):
        with pytest.raises(DeadCentreError, match=r"66\.74 deg: link l3"):
            peak(TURNING, start, speed)


def test_friction_holds_a_door_beyond_its_dead_centre() -> None:
    """If friction holds the door beyond its dead centre, w' exists."""
    door = replace(TURNING, friction=4.0)
    angle = DEAD_CENTRE + 0.05
    assert door.restoring_torque(angle) < 0.0
    omega = initial_velocity(door, angle)
    assert peak(door, 0.0, omega).angle == pytest.approx(angle, abs=1e-6)


@pytest.mark.parametrize(("l1", "degrees"), [(MIRRORED.l1, 66.74), (0.25, 103.40)])
def test_a_door_with_a_dead_centre_in_its_working_range_is_refused(
    tmp_path: Path, l1: float, degrees: float
) -> None:
    """An angle of 90 deg or less is refused with file and angle."""
    linkage = replace(MIRRORED, l1=l1)
    tau = float(9.0 / linkage.eta(0.0) - 0.5 * linkage.f(0.0))
    path = tmp_path / "door.yaml"
    config = replace(load_door("paper"), linkage=linkage, k_c=0.5, tau_c0_prime=tau)
    path.write_text(config.to_yaml())
    if math.radians(degrees) > WORKING_RANGE:
        found = load_door(path).door().dead_centre()
        assert found == pytest.approx(math.radians(degrees), abs=1e-3)
        return
    with pytest.raises(ConfigError, match=r"door\.yaml.*66\.74 deg") as caught:
        load_door(path)
    assert caught.value.value == pytest.approx(DEAD_CENTRE)
    assert caught.value.limit == WORKING_RANGE
