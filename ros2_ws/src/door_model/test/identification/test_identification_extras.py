"""Identification of what real closers add to the paper's model."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from door_model.door.config import load_door
from door_model.door.door import Door, Zone
from door_model.errors import DoorParameterError, NoFitError, NoSwingError
from door_model.identification.doubts import doubts
from door_model.identification.identify import Identification, identify
from door_model.identification.parameters import PARAMETERS, as_door
from door_model.identification.scale import Scale
from door_model.recording.synthetic import synthetic_recording

PAPER = load_door("paper").door()
EXACT = Scale(PAPER.i_a, 0.0, "known")
PEAKS_DEG = (9.0, 13.0, 17.0, 21.0, 25.0)
TRUTH = {
    "friction": replace(PAPER, friction=0.4, c_c_closing=0.25),
    "latch": replace(PAPER, c_c_closing=0.2, latch=Zone(math.radians(10.0), 0.5)),
    "backcheck": replace(PAPER, backcheck=Zone(math.radians(60.0), 3.0)),
}
FAR = (20.0, 40.0, 65.0, 75.0, 85.0)


def found(door: Door, extras: Sequence[str], peaks: Sequence[float] = PEAKS_DEG) -> Identification:
    """Identify a door from five swings with 0.2 deg of play."""
    recording = synthetic_recording(
        door, np.radians(peaks).tolist(), phase=0.3, play=math.radians(0.2))
    return identify(recording, door.closer, EXACT, extras=extras)


@pytest.mark.parametrize("name", TRUTH)
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


@pytest.mark.parametrize(
    "name", ["friction", pytest.param("latch", marks=pytest.mark.nightly("another extra"))])
def test_what_is_missing_is_named(name: str) -> None:
    """If a door has an extra that was not wanted, a warning recommends to identify it."""
    result = found(TRUTH[name], [])
    assert any(f"if {name} were identified, too" in warning for warning in result.warnings)


def test_off_by_default() -> None:
    """The paper's door is identified without friction and zones."""
    result = found(PAPER, [])
    assert result.names == ("i_a", "c_c", "k_c", "tau_c0_prime", "c_c_closing")
    assert result.door.friction == 0.0
    assert result.door.latch is None
    assert result.door.backcheck is None


def test_extras_that_are_not_there_are_small_or_uncertain() -> None:
    """Friction of a door without friction is 0 within its standard deviation."""
    result = found(PAPER, ["friction"])
    assert abs(result.value_of("friction")) < max(3.0 * result.std_of("friction"), 0.01)


@pytest.mark.nightly("five seconds: several fits")
def test_zones_that_the_swings_leave_open_are_said() -> None:
    """If two latch zones explain small swings equally, the result names both."""
    door = replace(PAPER, backcheck=Zone(math.radians(20.0), 0.5), latch=Zone(0.15, 0.3),
                   friction=0.2, c_c_closing=0.2)
    result = found(door, ["backcheck", "latch", "friction"])
    near = abs(result.value_of("latch_angle") - 0.15) < math.radians(1.0)
    assert near or any("fit as well with latch_angle" in warning for warning in result.warnings)


@pytest.mark.nightly("five seconds: several fits")
def test_zones_that_are_not_there_are_left_out_and_said() -> None:
    """Zones that the paper's door lacks are left out with a warning; no swing is lost."""
    result = found(PAPER, ["friction", "latch", "backcheck"], (11.0, 16.0, 20.0, 25.0, 29.0))
    assert result.names == (*PARAMETERS, "c_c_closing", "friction")
    assert len(result.swings) == 5
    assert {w for w in result.warnings if w.endswith("it was left out")} == {
        f"the {zone} has no effect on the swings: it was left out"
        for zone in ("latch", "backcheck")}


@pytest.mark.nightly("five seconds: several fits")
def test_two_that_are_missing_are_named_together() -> None:
    """Friction and a latch zone that explain the swings only together are named together."""
    door = replace(PAPER, k_c=1.3, tau_c0_prime=4.0, c_c_closing=0.6, friction=0.2,
                   latch=Zone(0.175, 0.15))
    asked = found(door, [])
    assert any("if friction and latch were identified, too" in w for w in asked.warnings)
    result = found(door, ["friction", "latch"])
    assert result.door.k_c == pytest.approx(1.3, rel=0.01)
    assert result.door.friction == pytest.approx(0.2, abs=0.01)
    assert result.warnings == []


def test_extras_of_opening_alone_are_not_dropped_in_silence() -> None:
    """A warning says that a latch zone cannot be identified from opening alone."""
    recording = synthetic_recording(PAPER, np.radians(PEAKS_DEG).tolist())
    result = identify(recording, PAPER.closer, EXACT, extras=["latch"], window="opening")
    assert "latch was not identified: this needs closing, too" in result.warnings


@pytest.mark.nightly("five seconds: several fits")
def test_another_doors_linkage_is_doubted() -> None:
    """If link 2 is 3 cm too long, a warning asks to check the linkage."""
    recording = synthetic_recording(PAPER, np.radians(PEAKS_DEG).tolist())
    wrong = replace(PAPER.closer, l2=0.25)
    result = identify(recording, wrong, EXACT)
    assert any("check the lengths of the linkage" in warning for warning in result.warnings)


def test_a_zero_that_is_not_the_shut_doors_is_doubted() -> None:
    """A door that rests at 7.5 deg, or whose angle falls as it opens, causes a warning."""
    recording = synthetic_recording(PAPER, np.radians(PEAKS_DEG).tolist())
    moved = replace(recording, theta=recording.theta + math.radians(7.5))
    assert any("rests at 7.5" in w for w in identify(moved, PAPER.closer, EXACT).warnings)
    with pytest.raises(NoSwingError, match="check that it grows as the door opens"):
        identify(replace(recording, theta=-recording.theta), PAPER.closer, EXACT)


def test_bounds_hold_and_are_told() -> None:
    """A value stays within its bound, and a warning says that it is at the bound."""
    recording = synthetic_recording(PAPER, np.radians(PEAKS_DEG).tolist())
    free = identify(recording, PAPER.closer, EXACT)
    wide = identify(recording, PAPER.closer, EXACT, bounds={"k_c": (0.1, 10.0)})
    tight = identify(recording, PAPER.closer, EXACT, bounds={"k_c": (0.5, 1.1)})
    np.testing.assert_allclose(wide.values, free.values, rtol=1e-4)
    assert tight.door.k_c == pytest.approx(1.1, rel=1e-3)
    assert tight.fit_rmse > free.fit_rmse
    assert any("k_c is at its bound" in warning for warning in tight.warnings)
    far = identify(recording, PAPER.closer, EXACT, bounds={"k_c": (0.3, 0.6)})
    assert any("times what the encoder explains" in warning for warning in far.warnings)
    with pytest.raises(NoFitError, match=r"do not follow|does not pull"):
        identify(recording, PAPER.closer, EXACT, bounds={"k_c": (8.0, 9.0)})


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"bounds": {"i_a": (1.0, 2.0)}}, "parameter of a bound"),
        ({"bounds": {"k_c": (2.0, 1.0)}}, "bounds of k_c"),
        ({"bounds": {"friction": (0.0, 1.0)}}, "one that is fitted"),
        ({"extras": ["rust"]}, "an extra must be of friction"),
    ],
)
def test_nonsense_is_refused(options: dict[str, object], match: str) -> None:
    """Bounds of what is not fitted, reversed bounds and unknown extras are refused."""
    recording = synthetic_recording(PAPER, np.radians(PEAKS_DEG[:3]).tolist())
    with pytest.raises((DoorParameterError, NoFitError), match=match):
        identify(recording, PAPER.closer, EXACT, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("off_deg", [-0.15, 0.15])
def test_an_encoder_zeroed_on_a_door_ajar(off_deg: float) -> None:
    """With an uncertain zero, the fit finds the zero and the curve of the torque."""
    recording = synthetic_recording(PAPER, np.radians(PEAKS_DEG).tolist(), play=math.radians(0.2))
    moved = replace(recording, theta=recording.theta + math.radians(off_deg))
    result = identify(moved, PAPER.closer, EXACT, zero_std=math.radians(0.2))
    angles = np.linspace(0.0, math.radians(25.0), 40)
    ratio = result.door.restoring_torque(angles) / PAPER.restoring_torque(angles)
    assert math.degrees(result.zero) == pytest.approx(off_deg, abs=0.05)
    assert np.abs(ratio - 1.0).max() < 0.01


def test_what_the_swings_cannot_tell_is_said() -> None:
    """The opening of three equal small swings does not determine viscosity and spring."""
    recording = synthetic_recording(PAPER, np.radians([5.0, 5.2, 5.4]).tolist(), phase=0.3)
    result = identify(recording, PAPER.closer, EXACT, window="opening")
    said = " ".join(result.warnings)
    for name in ("c_c", "k_c", "tau_c0_prime"):
        assert (name in said) == (result.std_of(name) > 0.1 * result.value_of(name)), said
    assert "c_c" in said


def test_doubts_name_what_goes_together() -> None:
    """Two parameters with a known sum only are named together; a third one is not."""
    covariance = np.array([[1.0, -0.99, 0.0], [-0.99, 1.0, 0.0], [0.0, 0.0, 0.01]])
    (said,) = doubts(("c_c", "k_c", "friction"), np.array([4.0, 4.0, 4.0]), covariance)
    assert "cannot tell c_c and k_c apart" in said
    assert doubts(("c_c",), np.array([4.0]), np.array([[0.01]])) == []
    (bound,) = doubts(("k_c",), np.array([0.0]), np.array([[0.01]]))
    assert bound == "k_c is at its bound of 0, +- 0.1 N m/rad"


def test_correlations_are_those_of_the_covariance() -> None:
    """Correlations are 1 on the diagonal, between -1 and 1 elsewhere, and 0 with an exact I_A."""
    result = found(PAPER, ["friction"])
    correlation = result.correlation
    np.testing.assert_allclose(np.diag(correlation)[1:], 1.0)
    assert (np.abs(correlation) <= 1.0 + 1e-12).all()
    assert (correlation[0] == 0.0).all()


def test_door_of_parameters_is_the_door() -> None:
    """Names and values give back the door with its zones and friction."""
    door = replace(TRUTH["latch"], friction=0.3, backcheck=Zone(1.0, 2.0))
    names = ("i_a", "c_c", "k_c", "tau_c0_prime", "c_c_closing", "friction", "backcheck_c_c",
             "backcheck_angle", "latch_c_c", "latch_angle")
    values = [door.i_a, door.c_c, door.k_c, door.tau_c0_prime, 0.2, 0.3, 2.0, 1.0, 0.5,
              math.radians(10.0)]
    assert as_door(names, np.array(values), door.closer) == door
