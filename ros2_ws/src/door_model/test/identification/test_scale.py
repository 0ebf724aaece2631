"""Measurements that fix the scale, which free swings leave open."""

import math

import numpy as np
import pytest
from door_model.door.config import load_door
from door_model.errors import DoorParameterError, LinkageError, NoScaleError
from door_model.identification.identify import Identification, identify
from door_model.identification.scale import (
    ForceGauge,
    ForceReading,
    KnownImpulse,
    Reference,
    scale_from_inertia,
)
from door_model.recording.recording import Recording
from door_model.recording.synthetic import five_swings, synthetic_recording
from scipy.integrate import trapezoid

PAPER = load_door("paper").door()
PEAKS = np.radians([9.0, 13.0, 17.0, 21.0, 25.0]).tolist()


@pytest.fixture(scope="module")
def recording() -> Recording:
    """Return a recording of five pushes on the paper's door."""
    return synthetic_recording(PAPER, PEAKS)


def reading(angle: float, *, error: float = 0.0) -> ForceReading:
    """Return what a force gauge 0.8 m from the hinge shows on the paper's door."""
    return ForceReading(angle, (float(PAPER.restoring_torque(angle)) + error) / 0.8, 0.8)


def run(recording: Recording, reference: Reference) -> Identification:
    """Identify the paper's door with a reference."""
    return identify(recording, PAPER.closer, reference)


def test_a_force_gauge_fixes_the_scale(recording: Recording) -> None:
    """Exact readings give I_A to 0.2 %, with the spread of a gauge of 0.5 N and 2 mm."""
    angles = (0.05, 0.2, 0.4)
    result = run(recording, ForceGauge([reading(angle) for angle in angles]))
    assert result.door.i_a == pytest.approx(PAPER.i_a, rel=2e-3)
    one = reading(angles[0])
    assert result.std_of("i_a") / result.door.i_a == pytest.approx(
        one.torque_std / one.torque / math.sqrt(len(angles)), rel=0.3)
    assert result.warnings == []
    typed = ForceReading(math.radians(0.35), reading(0.35).force, 0.8)
    for rows in ([typed], [reading(0.4), typed]):
        said = run(recording, ForceGauge(rows)).warnings
        assert any("if that is 0.35 rad, give 20.1 deg" in text for text in said)


def test_torque_at_a_reading_is_known_as_well_as_the_reading(recording: Recording) -> None:
    """At a reading's angle the torque is as certain as the reading: correlations are right."""
    one = reading(0.3)
    result = run(recording, ForceGauge([one]))
    f, eta = PAPER.closer.f_and_eta(0.3)
    slope = np.array([0.0, 0.0, eta * f, eta, 0.0])
    std = math.sqrt(slope @ result.covariance @ slope)
    assert float(result.door.restoring_torque(0.3)) == pytest.approx(one.torque, rel=1e-9)
    assert std == pytest.approx(one.torque_std, rel=1e-6)


def test_play_does_not_bias_the_impulse() -> None:
    """With play the impulse still gives I_A within two standard deviations."""
    push = five_swings(PAPER, PEAKS)[0][4]
    t = push.start + np.linspace(0.0, push.duration, 20001)
    torque = np.array([push.torque(time) for time in t])
    moves = int(np.argmax(torque > float(PAPER.restoring_torque(0.0))))
    impulse = float(trapezoid(torque[moves:], t[moves:]))
    result = run(synthetic_recording(PAPER, PEAKS, play=math.radians(0.2)),
                 KnownImpulse(impulse, 0.005 * impulse, 5))
    assert abs(result.door.i_a - PAPER.i_a) < 2.0 * result.std_of("i_a")


def test_inertia_as_given(recording: Recording) -> None:
    """A given I_A is used as it is, and its spread is added to all parameters."""
    result = run(recording, scale_from_inertia(12.75, 0.6375))
    assert result.door.i_a == 12.75
    for name in ("i_a", "k_c", "tau_c0_prime"):
        assert result.std_of(name) / result.value_of(name) == pytest.approx(0.05, rel=0.03)


def test_readings_that_cannot_be_or_contradict(recording: Recording) -> None:
    """Degrees and centimetres are refused; contradictions widen the answer and are said."""
    for wrong in (lambda: ForceReading(0.1, 7.0, 85.0), lambda: ForceReading(-0.1, 7.0, 0.8),
                  lambda: KnownImpulse(8.0, 0.1, 1.4),
                  lambda: run(recording, ForceGauge([ForceReading(10.0, 7.0, 0.8)]))):
        with pytest.raises((DoorParameterError, LinkageError, NoScaleError)):
            wrong()
    agree = run(recording, ForceGauge([reading(0.1), reading(0.3)]))
    apart = run(recording, ForceGauge([reading(0.1, error=1.0), reading(0.3, error=-1.0)]))
    assert apart.std_of("i_a") > 2.0 * agree.std_of("i_a")
    apart = run(recording, ForceGauge([reading(0.4, error=20.0), reading(0.2)]))
    assert any("contradict each other" in warning for warning in apart.warnings)
