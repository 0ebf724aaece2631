"""Batches of counter values, checked and decoded in the order in which they come."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from door_encoder.counts import Counts, check_modulus, stationary_zero, unwrap
from door_encoder.errors import BadBatchError, EncoderSettingError

_RESTART_NS = 1_000_000_000  # a batch that is late by more than this comes from a new start
_STAMP_SLACK_NS = 2_000_000  # jitter of stamps; beyond it and half a period it is a gap


@dataclass(frozen=True)
class Settings:
    """How counts become angles.

    Attributes:
        counts_per_turn: Counts a turn of the hinge, quadrature included.
        modulus: Counts after which the counter wraps; 0 if it never does.
        direction: 1 if the count grows as the door opens, -1 if it falls.
        zero: Counter value at the closed door; None: the mean of the first stationary samples.
        zero_samples: How many stationary samples give the zero.
        max_speed: Fastest plausible door [rad/s]; faster jumps are flagged.

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


@dataclass(frozen=True)
class Batch:
    """A batch of raw samples.

    Attributes:
        stamp_ns: Time of the first sample [ns].
        period: Time between two samples [s].
        first_index: Running number of the first sample.
        counts_per_turn: Counts a turn that the sender states.
        values: Counter values (N,).
        gap_before: The sender says that samples are missing before this batch.
    """

    stamp_ns: int
    period: float
    first_index: int
    counts_per_turn: int
    values: Sequence[int]
    gap_before: bool = False


@dataclass(frozen=True)
class Decoded:
    """A batch after decoding.

    Attributes:
        stamp_ns: Time of the first sample [ns].
        period: Time between two samples [s].
        first_index: Running number of the first sample.
        counts: Counts (N,), positive when the door opens, zero at the closed door.
        gap_before: Samples are missing between the batch before and this one.
    """

    stamp_ns: int
    period: float
    first_index: int
    counts: Counts
    gap_before: bool


@dataclass
class Health:
    """What has gone wrong so far, as running totals.

    Attributes:
        batches: Batches decoded.
        samples: Samples decoded.
        lost: Samples missing by their running numbers.
        gaps: Gaps, by numbers, stamps or the sender's word.
        late: Batches dropped because they came late or twice.
        refused: Batches refused because they made no sense.
        jumps: Steps faster than a door can move.
        restarts: Times the sender began anew.
    """

    batches: int = 0
    samples: int = 0
    lost: int = 0
    gaps: int = 0
    late: int = 0
    refused: int = 0
    jumps: int = 0
    restarts: int = 0


class EncoderDecoder:
    """Decodes batches one after the other.

    Attributes:
        settings: How counts become angles.
        health: Running totals.
        zero: Unwrapped count of the closed door; None until it is known.
    """

    def __init__(self, settings: Settings | None = None) -> None:
        self.settings = Settings() if settings is None else settings
        self.health = Health()
        self.zero: float | None = None
        self._last: tuple[int, int] | None = None  # counter value and what it was unwrapped to
        self._next_index = 0
        self._next_stamp_ns = 0
        self._still: list[int] = []

    def decode(self, batch: Batch) -> Decoded | None:
        """Decode a batch.

        Samples that overlap with the batch before are cut off. Until the zero is known (the door
        has not stood still for long enough yet) nothing comes out.

        Args:
            batch: The batch.

        Returns:
            The decoded batch; None if it came late or twice, or while the zero is not known.

        Raises:
            BadBatchError: The batch makes no sense; the decoder goes on as if it never came.
        """
        values = self._checked(batch)
        first, stamp_ns, gap = batch.first_index, batch.stamp_ns, batch.gap_before
        period_ns = batch.period * 1e9
        if self._last is not None:
            if self._restarted(batch):
                self._forget()
                gap = True
            elif first < self._next_index:
                overlap = self._next_index - first
                if overlap >= len(values):
                    self.health.late += 1
                    return None
                values, first = values[overlap:], self._next_index
                stamp_ns += round(overlap * period_ns)
            elif first > self._next_index:
                self.health.lost += first - self._next_index
                gap = True
            drift = abs(stamp_ns - self._next_stamp_ns)
            if self._last is not None and not gap and drift > _STAMP_SLACK_NS + 0.5 * period_ns:
                gap = True
        unwrapped = unwrap(values, self.settings.modulus, self._last)
        self._flag_jumps(unwrapped, batch.period, gap)
        self.health.gaps += int(gap)
        self.health.batches += 1
        self.health.samples += len(values)
        self._last = (int(values[-1]), int(unwrapped[-1]))
        self._next_index = first + len(values)
        self._next_stamp_ns = stamp_ns + round(len(values) * period_ns)
        zero = self._find_zero(values, unwrapped)
        if zero is None:
            return None
        counts = self.settings.direction * (unwrapped - round(zero))
        return Decoded(stamp_ns, batch.period, first, counts, gap)

    def _checked(self, batch: Batch) -> Counts:
        """The values of a batch that makes sense."""
        problem: tuple[str, object, object] | None = None
        if not len(batch.values):
            problem = ("is empty", 0, 1)
        elif not (math.isfinite(batch.period) and batch.period > 0.0):
            problem = (f"has a period of {batch.period} s", batch.period, "a positive number")
        elif batch.counts_per_turn != self.settings.counts_per_turn:
            expected = self.settings.counts_per_turn
            problem = (
                f"has {batch.counts_per_turn} counts a turn, not {expected}",
                batch.counts_per_turn,
                expected,
            )
        if problem is not None:
            self.health.refused += 1
            text, value, limit = problem
            raise BadBatchError(
                f"batch at sample {batch.first_index} {text}", value=value, limit=limit
            )
        return np.asarray(batch.values, dtype=np.int64)

    def _restarted(self, batch: Batch) -> bool:
        """The sender began anew: its numbers go back while its time does not, or both far."""
        if batch.first_index >= self._next_index:
            return False
        ahead = batch.stamp_ns - self._next_stamp_ns
        return ahead >= 0 or ahead < -_RESTART_NS

    def _forget(self) -> None:
        """Begin anew: a counter that was switched off has lost its zero."""
        self.health.restarts += 1
        self.zero = None
        self._last = None
        self._still = []

    def _flag_jumps(self, unwrapped: Counts, period: float, gap: bool) -> None:
        """Count the steps that no door can make."""
        limit = self.settings.max_speed * period / self.settings.radians_per_count + 1.0
        steps = np.abs(np.diff(unwrapped))
        if self._last is not None and not gap:
            steps = np.append(steps, abs(int(unwrapped[0]) - self._last[1]))
        self.health.jumps += int(np.count_nonzero(steps > limit))

    def _find_zero(self, values: Counts, unwrapped: Counts) -> float | None:
        """The zero, as soon as it is known."""
        if self.zero is not None:
            return self.zero
        if self.settings.zero is not None:
            # The counter's value nearest to the zero value decides how often it has wrapped.
            start = unwrap(
                np.array([self.settings.zero]),
                self.settings.modulus,
                (int(values[0]), int(unwrapped[0])),
            )
            self.zero = float(start[0])
            return self.zero
        self._still = [*self._still, *unwrapped.tolist()]
        # The newest samples that may be still; older ones go once the door has moved.
        keep = self.settings.zero_samples
        while len(self._still) >= keep and self.zero is None:
            self.zero = stationary_zero(np.array(self._still[:keep]), keep)
            if self.zero is None:
                self._still = self._still[1:]
        return self.zero
