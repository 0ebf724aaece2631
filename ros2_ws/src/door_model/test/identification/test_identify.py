"""Identification from free swings, eq. (6)."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from door_model.door.closer import FourBarCloser
from door_model.door.config import load_door
from door_model.door.door import Door
from door_model.errors import BadRecordingError, NoScaleError, NoSwingError
from door_model.identification.identify import Window, identify
from door_model.identification.scale import Scale, scale_from_leaf
from door_model.motion.dynamics import follow_free
from door_model.recording.checks import with_lattice
from door_model.recording.recording import Recording, from_counts
from door_model.recording.swings import find_swings
from door_model.recording.synthetic import push_to, quantise, simulate_pushes, synthetic_recording

PAPER = load_door("paper").door()
PEAKS = np.radians([11.0, 16.0, 20.0, 25.0, 29.0])
EXACT = Scale(PAPER.i_a, 0.0, "known")


@pytest.fixture(scope="module")
def recording() -> Recording:
    """Return five swings of the paper's door as the encoder measures them."""
    return synthetic_recording(PAPER, PEAKS, phase=0.3)


def errors(door: Door, found: Door) -> np.ndarray:
    """Return the relative errors of c_c, k_c and tau'_c0."""
    names = ("c_c", "k_c", "tau_c0_prime")
    return np.array([getattr(found, name) / getattr(door, name) - 1.0 for name in names])


def test_paper_door_within_five_percent(recording: Recording) -> None:
    """c_c, k_c and tau'_c0 are right to 5 %, with residuals below the quantisation."""
    result = identify(recording, PAPER.closer, EXACT)
    assert (np.abs(errors(PAPER, result.door)) < 0.05).all()
    assert 0.0 < result.fit_rmse < 0.8 * 2 * math.pi / 14400 / math.sqrt(12)
    assert result.window is Window.SWING
    assert [s.peak for s in result.swings] == pytest.approx(PEAKS, abs=2e-4)
    assert result.warnings == []


def test_opening_alone_as_in_the_paper(recording: Recording) -> None:
    """From 10 deg to the peak k_c and tau'_c0 are right to 2 %, and c_c has a large std."""
    result = identify(
        recording, PAPER.closer, EXACT, window=Window.OPENING, start_angle=math.radians(10.0))
    assert (np.abs(errors(PAPER, result.door)[1:]) < 0.02).all()
    assert 0.02 < result.std_of("c_c") / PAPER.c_c < 0.1
    assert abs(result.door.c_c - PAPER.c_c) < 3.0 * result.std_of("c_c")
    assert result.door.c_c_closing is None
    starts = [s.theta_measured[0] for s in result.swings if s.peak > math.radians(15.0)]
    assert starts == pytest.approx([math.radians(10.0)] * 4, abs=2e-3)


@pytest.mark.parametrize("seed", range(2))
def test_random_doors_and_linkages(seed: int) -> None:
    """Errors of random doors stay within 4.5 standard deviations and 6 %."""
    rng = np.random.default_rng(seed)
    closer = FourBarCloser(*(np.array([0.195, 0.204, 0.22, 0.265]) * rng.uniform(0.9, 1.1, 4)), 0.6)
    door = Door(
        PAPER.i_a * rng.uniform(0.5, 2.0), PAPER.c_c * rng.uniform(0.5, 4.0),
        PAPER.k_c * rng.uniform(0.5, 2.0), PAPER.tau_c0_prime * rng.uniform(0.8, 2.5), closer)
    data = synthetic_recording(door, np.radians(rng.uniform(14.0, 30.0, 4)), phase=rng.uniform(),
                               push_duration=rng.uniform(0.08, 0.25))
    result = identify(data, closer, Scale(door.i_a, 0.0, "known"))
    error = errors(door, result.door)
    spread = np.array([result.std_of(name) / result.value_of(name) for name in result.names[1:4]])
    assert (np.abs(error) < 4.5 * spread).all()
    assert (np.abs(error) < 0.06).all()


def test_play_of_the_encoder_is_found() -> None:
    """Play is found to 0.01 deg, and spring and peaks stay right."""
    play_deg = 0.2
    recording = synthetic_recording(PAPER, PEAKS.tolist(), play=math.radians(play_deg))
    result = identify(recording, PAPER.closer, EXACT)
    assert result.play is not None
    assert math.degrees(result.play) == pytest.approx(play_deg, abs=0.01)
    assert (np.abs(errors(PAPER, result.door))[1:] < 0.005).all()
    found = np.array([swing.peak for swing in result.swings])
    np.testing.assert_allclose(np.degrees(found), np.degrees(PEAKS), atol=0.02)


def test_degrees_that_were_counts_are_taken_as_counts() -> None:
    """Degrees rounded to four digits give the same result as counts."""
    counts = synthetic_recording(PAPER, PEAKS.tolist(), phase=0.2, play=math.radians(0.1))
    degrees = np.round(np.degrees(counts.theta), 4)
    written = identify(Recording(counts.t, np.radians(degrees)), PAPER.closer, EXACT)
    known = identify(counts, PAPER.closer, EXACT)
    np.testing.assert_allclose(written.values, known.values, rtol=0.01)
    np.testing.assert_allclose(written.covariance, known.covariance, rtol=0.1, atol=1e-9)


def test_noise_is_no_lattice() -> None:
    """Noisy analogue angles get no resolution, and the stated uncertainty is right."""
    noise_deg = 0.05
    exact = synthetic_recording(PAPER, PEAKS.tolist(), counts_per_turn=2**22)
    rng = np.random.default_rng(4)
    noise = math.radians(noise_deg) * rng.normal(size=len(exact.t))
    noisy = Recording(exact.t, exact.theta + noise)
    assert with_lattice(noisy).resolution == 0.0
    result = identify(noisy, PAPER.closer, EXACT)
    spread = np.array([result.std_of(name) for name in result.names[1:4]])
    assert (np.abs(errors(PAPER, result.door)) * result.values[1:4] < 4.0 * spread).all()
    assert math.degrees(result.fit_rmse) == pytest.approx(noise_deg, rel=0.15)


def test_a_mirrored_linkage_whose_preload_is_negative() -> None:
    """tau'_c0 may be negative, since it belongs to theta_c = 0, which may be unreachable."""
    closer = replace(PAPER.closer, assembly=-1.0)
    door = Door(PAPER.i_a, 0.06, 2.0, -1.2 * 2.0 * float(closer.f(0.0)), closer)
    assert door.tau_c0_prime < 0.0
    assert float(door.restoring_torque(0.0)) > 0.0
    data = synthetic_recording(door, np.radians([8.0, 12.0, 16.0, 20.0]))
    result = identify(data, closer, EXACT)
    assert (np.abs(errors(door, result.door))[1:] < 0.02).all()
    assert result.window is Window.SWING


def test_pushes_before_the_door_has_shut_are_said(recording: Recording) -> None:
    """If a recording begins during a swing, this swing is not used, but named."""
    cut = recording.t > 0.7
    late = replace(recording, t=recording.t[cut], theta=recording.theta[cut])
    result = identify(late, PAPER.closer, EXACT)
    assert len(result.swings) == 4
    assert any("does not begin at the shut door" in warning for warning in result.warnings)


def test_one_sided_damper_is_told_apart() -> None:
    """Five times the damping of closing does not affect the viscosity of opening."""
    door = replace(PAPER, c_c_closing=0.3)
    motion = follow_free(door, 0.0, np.array([0.35, 0.45, 0.55, 0.65, 0.7]))
    theta, _ = motion.at(np.arange(0.0, 5.0, 1e-3))
    pieces = [np.zeros(300)]
    for column in theta.T:
        pieces += [column, np.zeros(300)]
    counts = np.rint(np.concatenate(pieces) / (2 * math.pi / 14400)).astype(int)
    result = identify(from_counts(np.arange(len(counts)) * 1e-3, counts), PAPER.closer, EXACT)
    assert (np.abs(errors(PAPER, result.door)) < 0.05).all()
    assert result.door.c_c_closing == pytest.approx(0.3, rel=0.03)


@pytest.mark.nightly("a fit that falls back, eleven seconds")
def test_closing_that_follows_no_model_is_left_out(recording: Recording) -> None:
    """If a latch zone slows closing below 12 deg, only opening is fitted."""
    t, theta = recording.t, recording.theta.copy()
    stretched_t, stretched = [], []
    for swing in find_swings(recording):
        top = swing.t[swing.peak_index]
        begin = np.searchsorted(t, swing.t[0] - 0.4)
        latch = int(np.argmax((t > top) & (theta < math.radians(12.0))))
        slow = np.interp(np.arange(0.0, 0.9, 5e-4), t[latch:] - t[latch], theta[latch:])
        stretched += [theta[begin:latch], slow, np.zeros(400)]
    theta = np.concatenate(stretched)
    stretched_t = np.arange(len(theta)) * 1e-3
    result = identify(Recording(stretched_t, theta, recording.resolution), PAPER.closer, EXACT)
    assert result.window is Window.OPENING
    assert any("closing does not follow" in warning for warning in result.warnings)
    assert (np.abs(errors(PAPER, result.door)[1:]) < 0.02).all()


def test_the_hand_is_not_in_the_window() -> None:
    """The free motion starts after the end of a push, short or long."""
    for duration in (0.08, 0.15, 0.3):
        push = push_to(PAPER, math.radians(22.0), 0.5, duration)
        swing = simulate_pushes(PAPER, [push], 4.0)
        (found,) = find_swings(from_counts(swing.t, quantise(swing)))
        assert push.start + duration <= found.t[0] < push.start + 2.0 * duration


@pytest.mark.parametrize(("change", "error"), [
    (lambda r: replace(r, t=1e3 * r.t), BadRecordingError),
    (lambda r: replace(r, t=0.02 * (np.arange(len(r.t)) // 20) + 2e-5 * (np.arange(len(r.t)) % 20)),
     BadRecordingError),
    (lambda r: replace(r, theta=0.0 * r.theta), NoSwingError),
    (lambda r: Recording(np.zeros(0), np.zeros(0)), NoSwingError),
    (lambda r: replace(r, theta=np.linspace(0.0, 0.5, len(r.t))), NoSwingError)],
    ids=["milliseconds", "times of batches", "shut", "empty", "ramp"])
def test_what_shows_no_swing_is_refused(
    recording: Recording, change: Callable[[Recording], Recording], error: type[Exception]
) -> None:
    with pytest.raises(error):
        identify(change(recording), PAPER.closer, EXACT)


def test_swings_fix_only_ratios(recording: Recording) -> None:
    """Twice the mass gives twice every parameter; without mass and width there is no answer."""
    light = identify(recording, PAPER.closer, scale_from_leaf(47.62, 0.896))
    heavy = identify(recording, PAPER.closer, scale_from_leaf(2 * 47.62, 0.896))
    for name in ("i_a", "c_c", "k_c", "tau_c0_prime"):
        assert heavy.value_of(name) == pytest.approx(2.0 * light.value_of(name))
    with pytest.raises(NoScaleError, match="ratios"):
        identify(recording, PAPER.closer, None)
    for mass, width in ((None, 0.9), (47.0, math.nan)):
        with pytest.raises(NoScaleError, match="ratios"):
            scale_from_leaf(mass, width)
