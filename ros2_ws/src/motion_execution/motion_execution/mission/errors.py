"""Errors of missions; `reason` is an error code of the actions in small letters."""

from __future__ import annotations

from door_impact_common.errors import DoorImpactError
from robot_driver.motion import Motion, Outcome
from walking.errors import NotReady

CODES = {
    Outcome.SUCCESS: "none", Outcome.NO_CONTACT: "no_contact", Outcome.STOPPED: "stopped",
    Outcome.FELL: "fell", Outcome.NOT_FOLLOWED: "driver_refused",
    Outcome.NOT_HELD: "not_held", Outcome.LOCKED: "locked", Outcome.LEAF_LOST: "leaf_lost"}
"""Error codes of the actions, in small letters, by the outcome of a motion."""


class Replaced(NotReady):
    """A newer goal took the place of this one; `value` is the number of steps that were made."""

    reason = "replaced"


class MotionFailed(DoorImpactError):
    """A motion has not ended as it should; `value` is its `Outcome`."""

    @classmethod
    def check(cls, motion: Motion, prefix: str = "") -> None:
        """Check how a motion has ended.

        Args:
            prefix: What does not follow, for the message.

        Raises:
            MotionFailed: It has not succeeded.
        """
        if motion.outcome is not Outcome.SUCCESS:
            raise cls(f"{prefix}{motion.reason or motion.outcome.value}", quantity="outcome",
                      value=motion.outcome, reason=CODES[motion.outcome])
