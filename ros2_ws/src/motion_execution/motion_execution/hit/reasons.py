"""The sentences that explain to a user how an execution ended, with their values and limits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from robot_driver.motion import Outcome

MISSED = ("no contact was detected: neither IMU and feet nor the door's encoder showed one before "
          "the run-up came to rest; the door stands farther away than planned, or it is open")
NO_LEAF = ("the probe found no leaf as far as the run-up goes; the door stands farther away than "
           "planned, or it is open")
NOT_FELT = ("the IMU stopped the probe, but neither did the leaf move nor did the feet feel a "
            "resistance")
OPENED = "the door was opened, and the robot went back"
STOPPED_AFTER_HIT = "the motion was stopped after the hit, as requested"


def locked(off: float) -> str:
    """Reason for a leaf that does not give, farther away than planned by a distance [m]."""
    return (f"the leaf is locked: the probe touched it {1e3 * off:+.0f} mm farther away than "
            "planned, but its encoder shows that it did not give")


def elsewhere(off: float) -> str:
    """Reason for a leaf farther away than planned by a distance that the run-up misses [m]."""
    return (f"the probe found the leaf {1e3 * off:+.0f} mm farther away than planned, where the "
            f"run-up does not keep its speed: plan with a door_distance {abs(off):.3f} m "
            f"{'larger' if off > 0.0 else 'smaller'}")


def stays_open(angle: float) -> str:
    """Reason for a leaf that stays at an angle after the probe [rad]."""
    return f"the leaf did not fall shut after the probe: it stands at {np.degrees(angle):.1f} deg"


def stopped(phase: str) -> str:
    """Reason of an execution that was stopped as requested, in the phase of this name."""
    return f"the motion was stopped in the phase {phase}, as requested"


def contact_too_late(late: float, limit: float) -> str:
    """Reason for a contact that was noticed later than its limit, both in [s]."""
    return (f"the contact was noticed {late:.2f} s late, at most {limit:g} s are allowed: the "
            "computer was busy, or messages were delayed")


def peak_too_late(late: float, limit: float) -> str:
    """Reason for a peak of the door that was noticed later than its limit, both in [s]."""
    return (f"the door's largest angle was noticed {late:.2f} s later than the hold allows for, at "
            f"most {limit:g} s are allowed: the computer was busy, or messages were delayed")


def no_peak(longest: float) -> str:
    """Reason for a door that has not turned round within a time after the hit [s]."""
    return (f"the door did not turn round within {longest:.1f} s after the hit: its encoder stands "
            "still, or the door stays open")


def too_far_off(peak: float, desired: float, limit: float) -> str:
    """Reason for a door whose peak is too far from the desired angle to be caught [rad]."""
    return (f"the door opened to {np.degrees(peak):.1f} deg, {np.degrees(desired):.1f} deg were "
            f"desired, and the arm catches it within {np.degrees(limit):.1f} deg of that")


def went_back(reason: str) -> str:
    """Add to a reason that the robot went back."""
    return f"{reason}; the robot went back from the door"


def held_verdict(
    angles: Sequence[float], planned: float, limit: float, *, anywhere: bool
) -> tuple[Outcome, str]:
    """Judge whether a door stands still, and near an angle if it was pushed there.

    Args:
        angles: Last angles of the door [rad].
        planned: Planned angle [rad].
        limit: Largest allowed distance from the planned angle, and largest allowed movement [rad].
        anywhere: Whether it may stand at any angle: that at which the hand has caught it.

    Returns:
        The outcome, and a reason if the door is not held, else an empty text.
    """
    held, spread = float(np.mean(angles)), float(np.ptp(angles))
    if max(0.0 if anywhere else abs(held - planned), spread) <= limit:
        return Outcome.SUCCESS, ""
    return Outcome.NOT_HELD, (
        f"the door is not held: it stands at {np.degrees(held):.1f} deg and moved by "
        f"{np.degrees(spread):.1f} deg at the end, {np.degrees(planned):.1f} deg were planned, and "
        f"{'' if anywhere else 'an error and '}a movement of at most {np.degrees(limit):.1f} deg "
        f"{'is' if anywhere else 'are'} allowed")
