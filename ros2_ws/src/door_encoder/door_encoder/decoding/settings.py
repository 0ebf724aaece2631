"""Settings that describe the encoder, its counter and the door."""

import math
from dataclasses import dataclass

from door_impact_common.errors import SettingError
from door_model.recording.counts import LARGEST_COUNT


@dataclass(frozen=True)
class Settings:
    """How raw counts become angles.

    Raises:
        SettingError: A setting is out of its range.
    """

    counts_per_turn: int = 14400  # in a turn of the hinge, quadrature included
    modulus: int = 2**32  # counts after which the counter wraps; 0 if it never does
    direction: int = 1  # 1 if the count grows as the door opens, -1 if it falls
    zero: int | None = None  # counter value at the closed door; None: of a door that stands still
    zero_samples: int = 20  # number of samples that stand still and give the zero
    max_speed: float = 20.0  # greatest plausible speed of the door [rad/s], for `JumpFilter`

    def __post_init__(self) -> None:
        """Check the settings."""
        if self.modulus < 0 or self.modulus == 1 or self.modulus > 2 * LARGEST_COUNT:
            raise SettingError("counter_modulus", self.modulus, "0 (it never wraps) or 2 to 2^62")
        if self.direction not in (1, -1):
            raise SettingError("direction", self.direction, "1 or -1")
        if self.zero is not None and abs(self.zero) > LARGEST_COUNT:
            raise SettingError("zero_count", self.zero, f"within +-{LARGEST_COUNT}")
        for name in ("counts_per_turn", "zero_samples", "max_speed"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise SettingError(name, value, "a positive number")

    @property
    def radians_per_count(self) -> float:
        """Angle of one count [rad]."""
        return 2.0 * math.pi / self.counts_per_turn
