"""The decoder: checks batches of raw counter values and decodes them in the order of arrival."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from door_model.recording.batch import SampleBatch
from door_model.recording.counts import LARGEST_COUNT, Counts, stationary_zero, unwrap

from door_encoder.decoding.health import Health, require_usable
from door_encoder.decoding.index import IndexCheck
from door_encoder.decoding.jumps import JumpFilter
from door_encoder.decoding.settings import Settings
from door_encoder.errors import BadBatchError

_RESTART_NS = 1_000_000_000  # a batch that is older by more than this comes from a new start [ns]
_STAMP_SLACK_NS = 2_000_000  # jitter of stamps; more than this and half a period is a gap [ns]


class EncoderDecoder:
    """Decodes batches of raw counts one after the other.

    Attributes:
        settings: Description of encoder, counter and door.
        health: Running totals of what was received and what has gone wrong.
        zero: Unwrapped count of the closed door; None until it is known.
        zero_in_doubt: Whether the counter has gained or lost counts, and no index pulse has
            confirmed yet how many.
        index: Check of the index pulses.
    """

    def __init__(self, settings: Settings | None = None) -> None:
        self.settings = Settings() if settings is None else settings
        self.health = Health()
        self.index = IndexCheck(self.settings.counts_per_turn)
        self._filter = JumpFilter(
            modulus=self.settings.modulus,
            max_rate=self.settings.max_speed / self.settings.radians_per_count,
            half_turn=self.settings.counts_per_turn // 2,
        )
        self._started = False
        self._gap = False  # whether samples are missing before the next output
        self._next_index = 0
        self._next_stamp_ns = 0
        self._begin_anew()

    @property
    def offset(self) -> int:
        """Number of counts that are subtracted from the counter's value after jumps."""
        return self._filter.offset

    def decode(self, batch: SampleBatch) -> list[SampleBatch]:
        """Decode a batch of raw counts.

        Samples that overlap with the batch before are cut off. Samples after a step that no door
        can make are dropped, as described at `JumpFilter`. Nothing is returned until the zero is
        known, which needs a door that stands still for `zero_samples`.

        Args:
            batch: Raw values of the counter.

        Returns:
            The believed samples as unwrapped, zeroed counts that are positive when the door opens.
            Usually this is one batch. It is none if the batch came late or twice, while the zero
            is not known, or while the counts make no sense.

        Raises:
            BadBatchError: The batch cannot be used; the decoder's state stays as it was.
        """
        try:
            require_usable(batch, self.settings.counts_per_turn)
        except BadBatchError:
            self.health.refused += 1
            raise
        placed = self._placed(batch)
        if placed is None:
            return []
        batch, elapsed = placed
        values = self._bounded(batch)
        offset = self.offset
        pieces = self._filter.take(values, batch.period, elapsed)
        if self.offset != offset:
            self.zero_in_doubt = self.offset != 0
        self.health.gaps += int(batch.gap_before)
        self.health.batches += 1
        self.health.samples += len(values)
        self.health.jumps = self._filter.jumps
        self.health.dropped = self._filter.dropped
        self._gap = self._gap or batch.gap_before
        decoded = []
        for piece in pieces:
            self._gap = self._gap or piece.after_jump
            if piece.new_level:
                self._forget_zero()
            zero = self._find_zero(values[piece.start :], piece.counts)
            if zero is None:
                continue
            decoded.append(
                SampleBatch(
                    stamp_ns=batch.stamp_ns + round(piece.start * batch.period * 1e9),
                    period=batch.period,
                    first_index=batch.first_index + piece.start,
                    counts_per_turn=batch.counts_per_turn,
                    counts=self.settings.direction * (piece.counts - round(zero)),
                    gap_before=self._gap,
                )
            )
            self._gap = False
        if len(pieces) == 1 and len(pieces[0].counts) == len(values):
            self._check_index(batch.index_counts, pieces[0].counts, batch.period)
        return decoded

    def _placed(self, batch: SampleBatch) -> tuple[SampleBatch, float] | None:
        """Place a batch in the stream.

        Returns:
            The batch without the samples that were received before, with its gap marked; and the
            time from the last sample before to its first sample [s], infinite if not known. None
            if all its samples were received before.
        """
        counts, first, gap = batch.counts, batch.first_index, batch.gap_before
        stamp_ns, period_ns = batch.stamp_ns, batch.period * 1e9
        elapsed = math.inf if gap else batch.period
        if self._started and self._restarted(batch):
            self.health.restarts += 1
            self._begin_anew()
            gap = True
        elif self._started:
            missing = first - self._next_index
            if missing < 0:
                if -missing >= len(counts):
                    self.health.late += 1
                    return None
                counts, first = counts[-missing:], self._next_index
                stamp_ns -= round(missing * period_ns)
                missing = 0
            self.health.lost += missing
            gap = gap or missing > 0
            elapsed += missing * batch.period
            drift_ns = stamp_ns - self._next_stamp_ns - missing * period_ns
            if abs(drift_ns) > _STAMP_SLACK_NS + 0.5 * period_ns:
                gap, elapsed = True, math.inf
        placed = replace(
            batch, first_index=first, stamp_ns=stamp_ns, counts=counts, gap_before=gap
        )
        self._started = True
        self._next_index = first + len(counts)
        self._next_stamp_ns = placed.end_ns
        return placed, elapsed

    def _bounded(self, batch: SampleBatch) -> Counts:
        """Return the counts of a batch, limited so that differences do not overflow."""
        if self.settings.modulus:
            return np.asarray(batch.counts % self.settings.modulus)
        return np.clip(batch.counts, -LARGEST_COUNT, LARGEST_COUNT)

    def _restarted(self, batch: SampleBatch) -> bool:
        """Return whether the sender began anew.

        It did if the running numbers go back and the time does not, or if both go back far. It did
        as well if it says so: by number 0 behind a gap.
        """
        if batch.first_index >= self._next_index:
            return False
        if batch.gap_before and not batch.first_index:
            return True
        ahead = batch.stamp_ns - self._next_stamp_ns
        return ahead >= 0 or ahead < -_RESTART_NS

    def _begin_anew(self) -> None:
        """Begin anew, because a counter that was switched off has lost its zero."""
        self._filter.reset()
        self._forget_zero()

    def _forget_zero(self) -> None:
        """Forget everything that depends on the counter's level."""
        self.zero: float | None = None
        self.zero_in_doubt = False
        self.index.reset()
        self._still: list[int] = []  # newest unwrapped counts, which may be stationary

    def _check_index(self, latched: Sequence[int] | Counts, counts: Counts, period: float) -> None:
        """Compare the counts at which the index was latched with its known count."""
        low, high = int(counts.min()), int(counts.max())
        near = self._filter.reach(period)
        for value in latched:
            count = self._filter.place(int(value))
            if not low - near <= count <= high + near:
                self.health.index_errors += 1  # The door was not there: it is noise.
            elif self.index.reference is None:
                if not self.zero_in_doubt:  # A first passage cannot confirm an offset.
                    self.index.learn(count)
            else:
                self._compare_index(count)

    def _compare_index(self, count: int) -> None:
        """Subtract the counts that were gained unnoticed, as soon as two passages show them."""
        passage = self.index.judge(count)
        self.health.index_errors += int(passage.error != 0)
        if passage.sure:
            self.zero_in_doubt = False
            if passage.error:
                self._filter.shift(passage.error)
                self._gap = True

    def _find_zero(self, values: Counts, unwrapped: Counts) -> float | None:
        """Return the unwrapped count of the closed door as soon as it is known.

        Args:
            values: Raw counter values (N,).
            unwrapped: Their unwrapped counts (N,).
        """
        if self.zero is not None:
            return self.zero
        if self.settings.zero is not None:
            # The first counter value decides how often the counter has wrapped since the zero.
            start = unwrap(
                np.array([self.settings.zero]),
                self.settings.modulus,
                (int(values[0]), int(unwrapped[0])),
            )
            self.zero = float(start[0])
            return self.zero
        self._still = [*self._still, *unwrapped.tolist()]
        keep = self.settings.zero_samples
        while len(self._still) >= keep and self.zero is None:
            self.zero = stationary_zero(np.array(self._still[:keep]), keep)
            if self.zero is None:
                self._still = self._still[1:]
        return self.zero
