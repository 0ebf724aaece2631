"""Stated uncertainties compared with the errors in many simulated recordings."""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from door_model.door.config import load_door
from door_model.door.door import Door
from door_model.identification.identify import Identification, identify
from door_model.identification.parameters import PARAMETERS
from door_model.identification.prediction import NORMAL_95, PredictedPeak, predict_peak
from door_model.identification.scale import scale_from_leaf
from door_model.motion.dynamics import peak
from door_model.recording.recording import from_counts
from door_model.recording.synthetic import five_swings, quantise, simulate_pushes, through_play

PAPER = load_door("paper").door()
MASS, WIDTH = 47.62, 0.896
PLAY = math.radians(0.2)
UNSEEN = 0.6  # [rad/s] from the closed door


@dataclass(frozen=True)
class Case:
    """A door, its identification, and the true motion of its next swing."""

    door: Door
    found: Identification
    highest: float
    predicted: PredictedPeak

    def errors(self) -> np.ndarray:
        """Return the errors of `PARAMETERS`."""
        return np.array([self.found.value_of(p) - getattr(self.door, p) for p in PARAMETERS])

    def stds(self) -> np.ndarray:
        """Return the standard deviations of `PARAMETERS`."""
        return np.array([self.found.std_of(p) for p in PARAMETERS])


def identified(doors: int, views: int) -> list[Case]:
    """Identify doors from five swings of 5 to 25 deg, with random phase, play and scale."""
    rng = np.random.default_rng(2015)
    found = []
    for _ in range(doors):
        door = replace(
            PAPER, i_a=MASS * WIDTH**2 / 3.0, c_c=rng.uniform(0.03, 0.2),
            k_c=rng.uniform(0.8, 1.6), tau_c0_prime=rng.uniform(3.0, 6.0))
        peaks = np.linspace(5.0, 25.0, 5) + rng.uniform(-2.0, 2.0, 5) * [0, 1, 1, 1, 0]
        pushes, duration = five_swings(
            door, np.radians(peaks).tolist(), push_duration=rng.uniform(0.1, 0.2))
        motion = simulate_pushes(door, pushes, duration)
        shown = replace(motion, theta=through_play(motion.theta, PLAY))
        for _ in range(views):
            scale = scale_from_leaf(
                MASS * (1.0 + 0.005 * rng.normal()), WIDTH + 1e-3 * rng.normal())
            counts = quantise(shown, phase=rng.uniform())
            result = identify(from_counts(shown.t, counts), door.closer, scale)
            ahead = predict_peak(result.door, result.names, result.covariance, UNSEEN)
            found.append(Case(door, result, math.radians(float(peaks.max())), ahead))
    return found


@pytest.mark.nightly("200 recordings are identified")
def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    """95 % intervals of parameters and of an unseen peak hold the truth in 90 to 99 %."""
    cases = identified(50, 4)
    inside = np.mean([np.abs(c.errors()) < NORMAL_95 * c.stds() for c in cases], axis=0)
    assert ((inside >= 0.90) & (inside <= 0.99)).all(), dict(zip(PARAMETERS, inside, strict=True))
    truth = [peak(c.door, 0.0, UNSEEN).angle for c in cases]
    held = np.mean([
        low < angle < high
        for (low, high), angle in zip((c.predicted.interval() for c in cases), truth, strict=True)])
    assert 0.90 <= held <= 0.995


def test_torque_and_an_unseen_peak_are_right_and_no_alarm_is_false() -> None:
    """Over the swings the torque to 0.5 % but for the scale, the peak to 0.1 deg."""
    for case in identified(2, 1):
        angles = np.linspace(0.0, case.highest, 40)
        scale = case.found.door.i_a / case.door.i_a
        ratio = case.found.door.restoring_torque(angles) / case.door.restoring_torque(angles)
        assert np.abs(ratio / scale - 1.0).max() < 0.005
        assert abs(case.predicted.angle - peak(case.door, 0.0, UNSEEN).angle) < math.radians(0.1)
        assert not [w for w in case.found.warnings if "left out" in w or "identified, too" in w]
        assert len(case.found.swings) == 5
