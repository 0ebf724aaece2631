"""Identification of what real closers add to the paper's model."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from door_model.door.config import load_door
from door_model.door.door import Door, Zone
from door_model.errors import DoorParameterError, NoFitError, NoSwingError
from door_model.identification.identify import Identification, identify
from door_model.identification.parameters import as_door
from door_model.identification.scale import Scale
from door_model.recording.synthetic import synthetic_recording

PAPER = load_door("paper").door()
EXACT = Scale(PAPER.i_a, 0.0, "known")
PEAKS_DEG = (9.0, 13.0, 17.0, 21.0, 25.0)
TRUTH = {
    "friction": replace(PAPER, friction=0.4, c_c_closing=0.25),
    "latch": replace(PAPER, c_c_closing=0.2, latch=Zone(math.radians(10.0), 0.5)),
    "backcheck": replace(PAPER, backcheck=Zone(math.radians(60.0), 3.0))}
FAR = (20.0, 40.0, 65.0, 75.0, 85.0)


def found(door: Door, extras: Sequence[str], peaks: Sequence[float] = PEAKS_DEG) -> Identification:
    """Identify a door from five swings with 0.2 deg of play."""
    recording = synthetic_recording(
        door, np.radians(peaks).tolist(), phase=0.3, play=math.radians(0.2))
    return identify(recording, door.closer, EXACT, extras=extras)


@pytest.mark.parametrize("name", [
    "friction", *(pytest.param(name, marks=pytest.mark.nightly("another extra"))
                  for name in ("latch", "backcheck"))])
def test_extras_are_found(name: str) -> None:
    """Each extra is right within 4 standard deviations or a percent, and the spring stays right."""
    door = TRUTH[name]
    result = found(door, [name], FAR if name == "backcheck" else PEAKS_DEG)
    truth = {"friction": door.friction, "c_c_closing": door.closing_viscosity, "c_c": door.c_c,
             "k_c": door.k_c, "tau_c0_prime": door.tau_c0_prime, "i_a": door.i_a}
    for zone in ("latch", "backcheck"):
        if getattr(door, zone):
            truth |= {f"{zone}_angle": getattr(door, zone).angle,
                      f"{zone}_c_c": getattr(door, zone).c_c}
    for parameter in result.names:
        error = abs(result.value_of(parameter) - truth[parameter])
        assert error <= max(4.0 * result.std_of(parameter), 0.01 * truth[parameter]), parameter
    assert result.door.k_c == pytest.approx(PAPER.k_c, rel=0.01)
    assert result.warnings == []


@pytest.mark.nightly("ten seconds: several fits")
def test_what_is_missing_is_named() -> None:
    """If a door has an extra that was not wanted, a warning recommends to identify it."""
    result = found(TRUTH["friction"], [])
    assert any("if friction were identified, too" in warning for warning in result.warnings)


def test_a_zero_that_is_not_the_shut_doors_is_doubted() -> None:
    """A door that rests at 7.5 deg, or whose angle falls as it opens, causes a warning."""
    recording = synthetic_recording(PAPER, np.radians(PEAKS_DEG).tolist())
    moved = replace(recording, theta=recording.theta + math.radians(7.5))
    assert any("rests at 7.5" in w for w in identify(moved, PAPER.closer, EXACT).warnings)
    with pytest.raises(NoSwingError, match="grows"):
        identify(replace(recording, theta=-recording.theta), PAPER.closer, EXACT)


@pytest.mark.nightly("five seconds: several fits")
def test_bounds_hold_and_are_told() -> None:
    """A value stays within its bound, and a warning says that it is at the bound."""
    recording = synthetic_recording(PAPER, np.radians(PEAKS_DEG).tolist())
    free = identify(recording, PAPER.closer, EXACT)
    tight = identify(recording, PAPER.closer, EXACT, bounds={"k_c": (0.5, 1.1)})
    assert tight.door.k_c == pytest.approx(1.1, rel=1e-3)
    assert tight.fit_rmse > free.fit_rmse
    assert any("k_c is at its bound" in warning for warning in tight.warnings)
    with pytest.raises(NoFitError):
        identify(recording, PAPER.closer, EXACT, bounds={"k_c": (8.0, 9.0)})


def test_an_unknown_extra_is_refused() -> None:
    recording = synthetic_recording(PAPER, np.radians(PEAKS_DEG[:3]).tolist())
    with pytest.raises(DoorParameterError, match="rust"):
        identify(recording, PAPER.closer, EXACT, extras=["rust"])


def test_an_encoder_zeroed_on_a_door_ajar() -> None:
    """With an uncertain zero, the fit finds the zero and the curve of the torque."""
    off_deg = 0.15
    recording = synthetic_recording(PAPER, np.radians(PEAKS_DEG).tolist(), play=math.radians(0.2))
    moved = replace(recording, theta=recording.theta + math.radians(off_deg))
    result = identify(moved, PAPER.closer, EXACT, zero_std=math.radians(0.2))
    angles = np.linspace(0.0, math.radians(25.0), 40)
    ratio = result.door.restoring_torque(angles) / PAPER.restoring_torque(angles)
    assert math.degrees(result.zero) == pytest.approx(off_deg, abs=0.05)
    assert np.abs(ratio - 1.0).max() < 0.01


def test_door_of_parameters_is_the_door() -> None:
    """Names and values give back the door with its zones and friction."""
    door = replace(TRUTH["latch"], friction=0.3, backcheck=Zone(1.0, 2.0))
    names = ("i_a", "c_c", "k_c", "tau_c0_prime", "c_c_closing", "friction", "backcheck_c_c",
             "backcheck_angle", "latch_c_c", "latch_angle")
    values = [door.i_a, door.c_c, door.k_c, door.tau_c0_prime, 0.2, 0.3, 2.0, 1.0, 0.5,
              math.radians(10.0)]
    assert as_door(names, np.array(values), door.closer) == door
