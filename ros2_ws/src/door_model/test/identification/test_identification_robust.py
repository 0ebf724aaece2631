"""Identification from imperfect recordings: touched doors, stops, lost samples, garbage."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from door_model.door.config import load_door
from door_model.errors import BadRecordingError, NoFitError
from door_model.identification.identify import Identification, Window, identify
from door_model.identification.scale import Scale
from door_model.motion.dynamics import simulate
from door_model.recording.checks import garbage
from door_model.recording.recording import Recording, from_counts
from door_model.recording.synthetic import (
    Push,
    five_swings,
    simulate_pushes,
    synthetic_recording,
    through_play,
)
from hypothesis import given
from hypothesis import strategies as st

PAPER = load_door("paper").door()
EXACT = Scale(PAPER.i_a, 0.0, "known")
PEAKS = np.radians([9.0, 13.0, 17.0, 21.0, 25.0])
RESOLUTION = 2.0 * math.pi / 14400
PUSHES, LENGTH = five_swings(PAPER, PEAKS.tolist())
PERIOD = 1e-3

Change = Callable[[float, float, float], np.ndarray]


def shown(theta: np.ndarray) -> Recording:
    """Return angles as an encoder of 14,400 counts with 0.2 deg of play shows them."""
    counts = np.floor(through_play(theta, math.radians(0.2)) / RESOLUTION + 0.3).astype(np.int64)
    return from_counts(np.arange(len(theta)) * PERIOD, counts)


def swing_of(push: Push, length: float, change: tuple[float, Change] | None = None) -> np.ndarray:
    """Return the angles of a swing; from a given time its state is changed by a function."""
    motion = simulate_pushes(PAPER, [replace(push, start=0.3)], length)
    theta = motion.theta[:-1].copy()
    if change is not None:
        at = round(change[0] / PERIOD)
        rest = change[1](float(motion.theta[at]), float(motion.omega[at]), length)
        theta[at:] = 0.0
        end = min(len(theta), at + len(rest))
        theta[at:end] = np.maximum(rest[: end - at], 0.0)
    return theta


def recording_with(number: int, change: tuple[float, Change] | None) -> Recording:
    """Return a recording of five swings, of which one is changed."""
    starts = [push.start - 0.3 for push in PUSHES] + [LENGTH]
    return shown(np.concatenate([
        swing_of(push, end - start, change if i == number else None)
        for i, (push, start, end) in enumerate(zip(PUSHES, starts[:-1], starts[1:], strict=True))]))


def pushed_again(impulse: float) -> Change:
    """Return a change by a hand that pushes with an angular impulse [N m s]."""
    push = Push(0.0, impulse, 0.15)

    def change(theta: float, omega: float, length: float) -> np.ndarray:
        return simulate(PAPER, theta, omega, length, torque=push.torque, stop=True).theta

    return change


def thrown_back(theta: float, omega: float, length: float) -> np.ndarray:
    """Return the state after a stop that reverses 0.3 of the speed."""
    return simulate(PAPER, theta, -0.3 * omega, length, stop=True).theta


def torque_error(result: Identification) -> float:
    """Return the largest relative error of the restoring torque over the range of the swings."""
    angles = np.linspace(0.0, PEAKS.max(), 60)
    true = PAPER.restoring_torque(angles)
    return float(np.abs(result.door.restoring_torque(angles) / true - 1.0).max())


@pytest.fixture(scope="module")
def good() -> Recording:
    """Return a recording of five good swings."""
    return recording_with(-1, None)


@pytest.mark.parametrize("what", ["touched", "stopped"])
def test_a_swing_that_is_not_free_is_named_and_left_out(what: str) -> None:
    """A hand touches the door while it closes, or the leaf hits a stop at 8 deg."""
    number = ["touched", "stopped"].index(what)
    theta = swing_of(PUSHES[number], 4.0)
    if what == "touched":
        at = 0.45 + 1.3 * (int(np.argmax(theta)) * PERIOD - 0.45)
        recording = recording_with(number, (at, pushed_again(0.3)))
    else:
        at = int(np.argmax(theta >= math.radians(8.0))) * PERIOD
        recording = recording_with(number, (at, thrown_back))
    result = identify(recording, PAPER.closer, EXACT)
    assert torque_error(result) < 0.01
    assert len(result.swings) == 4
    assert any("was left out" in warning for warning in result.warnings)
    assert result.window is Window.SWING


@pytest.mark.parametrize("together", [1, 20], ids=["samples", "batches"])
def test_five_percent_lost(good: Recording, together: int) -> None:
    """Samples lost one by one or twenty at a time cost no swing."""
    piece = np.arange(len(good.t)) // together
    keep = (np.random.default_rng(0).uniform(size=piece[-1] + 1) > 0.05)[piece]
    lossy = Recording(good.t[keep], good.theta[keep], good.resolution)
    result = identify(lossy, PAPER.closer, EXACT)
    assert torque_error(result) < 0.01
    assert len(result.swings) == 5
    assert result.warnings == []


def test_a_batch_of_garbage_is_named_and_left_out(good: Recording) -> None:
    """Twenty samples of noise are named and left out."""
    rng = np.random.default_rng(1)
    theta, batch = good.theta.copy(), slice(700, 720)
    noise = np.radians(5.0) * rng.uniform(-1.0, 1.0, 20)
    theta[batch] = np.rint((theta[batch] + noise) / RESOLUTION) * RESOLUTION
    result = identify(replace(good, theta=theta), PAPER.closer, EXACT)
    assert torque_error(result) < 0.01
    assert any("no door can move like this" in warning for warning in result.warnings)


def test_missing_rows_whose_times_were_numbered_anew(good: Recording) -> None:
    """A swing that lacks 50 rows is left out; 20 of each 400, and each tenth, are refused."""
    number = np.arange(len(good.t))
    for kept in (abs(number - 15325) > 25, number % 400 >= 20, number % 10 > 0):
        short = replace(good, t=number[: kept.sum()] * PERIOD, theta=good.theta[kept])
        if kept[0]:
            result = identify(short, PAPER.closer, EXACT)
            assert any("left out: rows are missing" in warning for warning in result.warnings)
            assert len(result.swings) == 4
            assert torque_error(result) < 0.01
        else:
            with pytest.raises(BadRecordingError, match=r"rows are missing, .* the angle leaps"):
                identify(short, PAPER.closer, EXACT)


@pytest.mark.parametrize(("at", "end"), [(10000, None), (14400, None), (14400, 14401)])
def test_a_door_that_is_held_open_is_named_and_the_rest_is_used(
    good: Recording, at: int, end: int | None
) -> None:
    """It is held for longer than it is shut: in a swing, at the largest angle, or to the end."""
    counts = np.rint(good.theta / RESOLUTION).astype(np.int64)
    held = np.concatenate([counts[:at], np.full(20000, counts[at]), counts[at:end]])
    for raw in (held, 70000 - held):
        recording = from_counts(np.arange(len(held)) * PERIOD, raw, 14400, raw=True)
        result = identify(recording, PAPER.closer, EXACT)
        assert any(f"held open at {counts[at] / 40:.1f} deg from {at / 1e3:.1f} to" in warning
                   for warning in result.warnings)
        assert len(result.swings) == 4
        assert torque_error(result) < 0.01


@pytest.mark.parametrize(("window", "shares", "rest"), [
    (Window.OPENING, (1.2,), ""), (Window.AUTO, (1.2, 0.9), r", and those at 1\d.\d, 1\d.\d s")])
def test_a_closer_that_was_changed_between_two_swings_is_named(
    window: Window, shares: tuple[float, ...], rest: str
) -> None:
    """Swings that agree among themselves and not with the others are named by their times."""
    doors = [PAPER, *(replace(PAPER, tau_c0_prime=share * PAPER.tau_c0_prime) for share in shares)]
    parts = [synthetic_recording(door, np.radians([15.0, 24.0])) for door in doors]
    theta = np.concatenate([part.theta for part in parts])
    both = Recording(np.arange(len(theta)) * PERIOD, theta, RESOLUTION)
    match = rf"at 0.5, 3.\d s agree .* 7.\d, 10.\d s{rest}, but not with"
    with pytest.raises(NoFitError, match=match):
        identify(both, PAPER.closer, EXACT, window=window)


@given(st.floats(-9.0, 9.0), st.floats(0.1, 30.0), st.floats(0.0, 1.0))
def test_no_door_is_garbage(speed: float, rate: float, phase: float) -> None:
    """No sample of doors that fly, swing and bounce is garbage."""
    t = np.arange(0.0, 2.0, PERIOD)
    for theta in (speed * t, 0.5 * np.abs(np.sin(rate * t)) * min(1.0, 9.0 / rate)):
        counts = np.floor(theta / RESOLUTION + phase)
        assert not garbage(Recording(t, counts * RESOLUTION, RESOLUTION)).any()
