"""How counts become angles."""

import math
from dataclasses import dataclass

from door_encoder.decoding.counts import LARGEST_COUNT, check_modulus
from door_encoder.errors import EncoderSettingError


@dataclass(frozen=True)
class Settings:
    """How counts become angles.

    Attributes:
        counts_per_turn: Counts a turn of the hinge, quadrature included.
        modulus: Counts after which the counter wraps; 0 if it never does.
        direction: 1 if the count grows as the door opens, -1 if it falls.
        zero: Counter value at the closed door; None: the mean of the first stationary samples.
        zero_samples: How many stationary samples give the zero.
        max_speed: Fastest plausible door [rad/s]; faster steps are no motion (see `JumpFilter`).

    Raises:
        EncoderSettingError: One is out of its range.
    """

    counts_per_turn: int = 14400
    modulus: int = 2**32
    direction: int = 1
    zero: int | None = None
    zero_samples: int = 20
    max_speed: float = 20.0

    def __post_init__(self) -> None:
        """Check the settings."""
        check_modulus(self.modulus)
        if self.direction not in (1, -1):
            raise EncoderSettingError(
                f"direction must be 1 or -1, not {self.direction}",
                value=self.direction,
                limit=(1, -1),
            )
        if self.zero is not None and abs(self.zero) > LARGEST_COUNT:
            raise EncoderSettingError(
                f"zero must be within {LARGEST_COUNT} counts, not {self.zero}",
                value=self.zero,
                limit=LARGEST_COUNT,
            )
        for name in ("counts_per_turn", "zero_samples", "max_speed"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise EncoderSettingError(
                    f"{name} must be a positive number, not {value}", value=value, limit=0
                )

    @property
    def radians_per_count(self) -> float:
        """Angle of one count [rad]."""
        return 2.0 * math.pi / self.counts_per_turn
