"""Simulated recordings: a simulated door is pushed by hand, and an encoder measures its angle.

``python -m door_model.recording.synthetic --out FILE`` writes the sample recording of this package.
"""

import argparse
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from door_impact_common.files import run_command
from numpy.typing import NDArray
from scipy.optimize import brentq

from door_model.checks import require_not_negative
from door_model.door.config import load_door
from door_model.door.door import Door
from door_model.errors import LinkageError, UnreachableAngleError
from door_model.motion.driven_motion import SampledMotion
from door_model.motion.dynamics import initial_velocity, peak, simulate
from door_model.recording.recording import COUNTS_PER_TURN, Recording, from_counts, write_counts_csv

_FINE = 2e-4  # time between the points from which samples are interpolated [s]
_LONGEST_FALL = 20.0  # longest accepted fall of a door [s]
_OPEN = 1e-3  # a door that is further open has not fallen shut [rad]
_SAME_TIME = 1e-9  # times that differ by less are equal except for rounding [s]
_SHUT_SPEED = 0.02  # a door that hits its frame more slowly stays shut [rad/s]


@dataclass(frozen=True)
class Push:
    """A push by hand: a half sine of torque about the hinge.

    Attributes:
        start: Time at which the push begins [s].
        impulse: Angular impulse of the push [N m s].
        duration: Duration of the push [s].
    """

    start: float
    impulse: float
    duration: float = 0.15

    def torque(self, t: float) -> float:
        """Return the torque at a time [N m]."""
        phase = (t - self.start) / self.duration
        if not 0.0 < phase < 1.0:
            return 0.0
        return self.impulse * math.pi / (2.0 * self.duration) * math.sin(math.pi * phase)


def push_to(door: Door, angle: float, start: float = 0.0, duration: float = 0.15) -> Push:
    """Return the push that opens a shut door to an angle.

    Args:
        door: The door.
        angle: Opening angle [rad].
        start: Time at which the push begins [s].
        duration: Duration of the push [s].

    Raises:
        LinkageError: The linkage does not close at the angle.
        UnreachableAngleError: The door does not turn round there, or friction holds it shut.
    """
    free = door.i_a * initial_velocity(door, angle)
    high = 3.0 * free + 2.0 * duration * float(door.restoring_torque(0.0))

    def beyond(impulse: float) -> float:
        return _peak_of_push(door, Push(0.0, impulse, duration)) - angle

    try:
        impulse = brentq(beyond, 0.5 * free, high, xtol=1e-5 * free, rtol=1e-5)
    except ValueError as error:
        raise UnreachableAngleError(
            f"no push of {duration:g} s and up to {high:.3g} N m s opens the door to "
            f"{math.degrees(angle):.3g} deg",
            quantity="opening angle [rad]",
            value=angle,
            limit=f"an angle to which {high:.3g} N m s open the door",
        ) from error
    return Push(start, float(impulse), duration)


def _peak_of_push(door: Door, push: Push) -> float:
    """Return the angle to which a push opens a shut door [rad]."""
    pushed = simulate_pushes(door, [push], push.duration, period=push.duration / 50)
    theta, omega = float(pushed.theta[-1]), float(pushed.omega[-1])
    if not omega > 0.0:
        return float(pushed.theta.max())
    try:
        return peak(door, theta, omega).angle
    except LinkageError:
        return door.closer.opening_limit()  # it is flung open beyond the limit


def simulate_pushes(
    door: Door, pushes: Sequence[Push], duration: float, *, period: float = 1e-3,
    bounce: float = 0.2
) -> SampledMotion:
    """Simulate a door that is pushed and falls shut against its frame.

    Args:
        door: The door.
        pushes: Pushes in order of time; the door may be shut or moving when a push begins.
        duration: Time to simulate [s].
        period: Time between two samples [s].
        bounce: Coefficient of restitution between leaf and frame, at least 0 and below 1.
    """
    t = np.arange(math.floor(duration / period + 1e-9) + 1, dtype=np.float64) * np.float64(period)
    theta, omega = np.zeros(t.shape), np.zeros(t.shape)
    # Pieces end at the edges of pushes, so that no solver step crosses a kink of the torque.
    edges = sorted(
        {0.0, duration, *(p.start for p in pushes), *(p.start + p.duration for p in pushes)})
    now, state = 0.0, (0.0, 0.0)
    for end in (edge for edge in edges if 0.0 < edge <= duration):
        while now < end - 1e-9:
            now, state = _advance(door, pushes, now, end, state, bounce, (t, theta, omega))
    at_end = t >= duration - 1e-12
    theta[at_end], omega[at_end] = state
    return SampledMotion(t, theta, omega)


def _advance(
    door: Door, pushes: Sequence[Push], now: float, end: float, state: tuple[float, float],
    bounce: float, out: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
) -> tuple[float, tuple[float, float]]:
    """Simulate until `end` [s] or the next hit on the frame, and write the samples on the way.

    Returns:
        Time [s] and state [rad], [rad/s] at the end.
    """
    t, theta, omega = out

    def torque(after: float) -> float:
        return sum(push.torque(now + after) for push in pushes)

    if state == (0.0, 0.0):
        # The frame holds the shut door until the push outweighs the closer.
        hold = float(door.restoring_torque(0.0))
        fine = np.linspace(0.0, end - now, 401)
        above = [after for after in fine if torque(after) > hold]
        if not above:
            return end, state
        if above[0] > 0.0:
            return now + above[0], (0.0, 1e-9)
    length = end - now
    first = int(np.searchsorted(t, now - _SAME_TIME))
    pieces = max(1, math.ceil(length / _FINE))
    swing = simulate(
        door, state[0], state[1], length, period=length / pieces, torque=torque, stop=True)
    reached = float(swing.t[-1])
    hit = len(swing.t) <= pieces or bool(swing.theta[-1] <= 1e-12)
    inside = slice(first, int(np.searchsorted(t, now + reached - _SAME_TIME)))
    theta[inside] = np.interp(t[inside] - now, swing.t, swing.theta)
    omega[inside] = np.interp(t[inside] - now, swing.t, swing.omega)
    if hit:
        speed = -bounce * float(swing.omega[-1])
        return now + max(reached, 1e-9), (0.0, speed if speed > _SHUT_SPEED else 0.0)
    return end, (float(swing.theta[-1]), float(swing.omega[-1]))


def five_swings(
    door: Door, peaks: Sequence[float], *, spacing: float = 0.3, push_duration: float = 0.15
) -> tuple[list[Push], float]:
    """Return pushes to given peaks, each after the door has fallen shut.

    Args:
        door: The door.
        peaks: Largest opening angle of each push [rad].
        spacing: Time before each push [s].
        push_duration: Duration of a push [s].

    Returns:
        The pushes, and the time that they take until the door is shut [s].

    Raises:
        LinkageError: The linkage does not close at a peak.
        UnreachableAngleError: The door does not turn round there, or does not fall shut again.
    """
    pushes, start = [], spacing
    for angle in peaks:
        push = push_to(door, angle, start, push_duration)
        pushes.append(push)
        fall = _fall(door, angle)
        rise = peak(door, 0.0, initial_velocity(door, angle)).time
        start += push_duration + rise + fall + 0.5 + spacing
    return pushes, start


def _fall(door: Door, angle: float) -> float:
    """Return the time that a door takes to fall shut from rest at an angle [s]."""
    fall = simulate(door, angle, 0.0, _LONGEST_FALL, stop=True)
    if fall.theta[-1] > _OPEN:
        raise UnreachableAngleError(
            f"the door does not fall shut from {math.degrees(angle):.1f} deg: after "
            f"{_LONGEST_FALL:.0f} s it is still open at {math.degrees(fall.theta[-1]):.1f} deg",
            quantity="angle after the fall [rad]",
            value=float(fall.theta[-1]),
            limit=_OPEN,
        )
    return float(fall.t[-1])


def quantise(
    swing: SampledMotion, *, counts_per_turn: int = COUNTS_PER_TURN, phase: float = 0.5
) -> NDArray[np.int64]:
    """Return the counts of an incremental encoder, zero at the closed door (N,).

    Args:
        swing: The motion.
        counts_per_turn: Number of counts in a turn of the hinge.
        phase: Place of the closed door within its count, 0 to 1; 0.5 rounds to the nearest count.
    """
    return np.floor(swing.theta / (2.0 * math.pi / counts_per_turn) + phase).astype(np.int64)


def through_play(theta: NDArray[np.float64], play: float) -> NDArray[np.float64]:
    """Return the angles of an encoder that the leaf drives through a coupling with play (N,) [rad].

    Args:
        theta: Angles of the leaf (N,) [rad]; the encoder's zero is that of a door just closed.
        play: Free travel of the coupling [rad].
    """
    shown = np.empty_like(theta)
    now = float(theta[0])
    for number, angle in enumerate(theta):
        now = min(max(now, angle - play), angle)
        shown[number] = now
    return shown


def synthetic_recording(
    door: Door, peaks: Sequence[float], *, phase: float = 0.5, play: float = 0.0,
    counts_per_turn: int = COUNTS_PER_TURN, push_duration: float = 0.15
) -> Recording:
    """Simulate a recording of pushes, as an encoder measures it at 1 kHz.

    Args:
        door: The door.
        peaks: Largest opening angle of each push [rad].
        phase: Place of the closed door within its count, 0 to 1.
        play: Free travel between the leaf and the encoder [rad].
        counts_per_turn: Number of counts in a turn of the hinge.
        push_duration: Duration of a push [s].
    """
    pushes, duration = five_swings(door, peaks, push_duration=push_duration)
    swing = simulate_pushes(door, pushes, duration)
    swing = replace(swing, theta=through_play(swing.theta, play))
    counts = quantise(swing, counts_per_turn=counts_per_turn, phase=phase)
    return from_counts(swing.t, counts, counts_per_turn)


_EXAMPLE = """\
the sample recording of this package:
  python -m door_model.recording.synthetic --out paper_five_swings.csv

a door's YAML file may describe more than the paper's door. Copy one of share/door_model/doors and
add
  closer:
    c_c_closing: 0.5                     # [N m s/rad] while the door closes
    backcheck: {angle: 1.22, c_c: 3.0}   # while it opens beyond 1.22 rad
    latch: {angle: 0.2, c_c: 0.1}        # while it closes below 0.2 rad
  friction: 0.3                          # [N m] at the hinge
to record it through an encoder with play:
  python -m door_model.recording.synthetic --door my_door.yaml --play-deg 0.2 --out my_swings.csv
"""


def _parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(
        prog="python -m door_model.recording.synthetic",
        description="Write a recording of simulated pushes by hand, for identify --csv.",
        epilog=_EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", required=True, metavar="FILE", help="CSV file to write")
    parser.add_argument(
        "--door", default="paper", metavar="NAME_OR_YAML",
        help="door of this package, or a YAML file (default: %(default)s)")
    parser.add_argument(
        "--peaks-deg", type=float, nargs="+", default=[11.0, 16.0, 20.0, 25.0, 29.0], metavar="DEG",
        help="largest opening angle of each push (default: 11 16 20 25 29)")
    parser.add_argument(
        "--play-deg", type=float, default=0.0, metavar="DEG",
        help="free travel between leaf and encoder (default: %(default)g)")
    return parser


def _run(arguments: argparse.Namespace) -> str:
    """Make the recording, write it, and return the text to print."""
    require_not_negative("--play-deg", arguments.play_deg)
    config = load_door(arguments.door)
    made = synthetic_recording(
        config.door(), np.radians(arguments.peaks_deg).tolist(),
        play=math.radians(arguments.play_deg))
    counts = np.rint(made.theta / made.resolution).astype(np.int64)
    write_counts_csv(arguments.out, made.t, counts)
    peaks = ", ".join(f"{angle:g}" for angle in arguments.peaks_deg)
    return (
        f"written: {arguments.out}, {len(counts)} samples at 1 kHz, {COUNTS_PER_TURN} counts per "
        f"turn, play {arguments.play_deg:g} deg: door {config.name!r} pushed to {peaks} deg"
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Write a recording of simulated pushes; the exit code is 1 for errors."""
    arguments = _parser().parse_args(argv)
    return run_command("synthetic", lambda: _run(arguments))


if __name__ == "__main__":
    raise SystemExit(main())
