"""Batches of counter values, checked and decoded in the order in which they come."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from door_encoder.decoding.batch import Batch, Decoded, Health
from door_encoder.decoding.counts import LARGEST_COUNT, Counts, stationary_zero, unwrap
from door_encoder.decoding.index import IndexCheck
from door_encoder.decoding.jumps import JumpFilter
from door_encoder.decoding.settings import Settings
from door_encoder.errors import BadBatchError

_RESTART_NS = 1_000_000_000  # a batch that is late by more than this comes from a new start
_STAMP_SLACK_NS = 2_000_000  # jitter of stamps; beyond it and half a period it is a gap


class EncoderDecoder:
    """Decodes batches one after the other.

    Attributes:
        settings: How counts become angles.
        health: Running totals.
        zero: Unwrapped count of the closed door; None until it is known.
        zero_in_doubt: The counter has gained or lost counts, and no index has told how many.
        index: Where the index was seen.
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
        self._heard = False
        self._gap = False  # before what comes out next
        self._next_index = 0
        self._next_stamp_ns = 0
        self._begin_anew()

    @property
    def offset(self) -> int:
        """Counts taken out of the counter's value, since it cannot have been the door's."""
        return self._filter.offset

    def decode(self, batch: Batch) -> list[Decoded]:
        """Decode a batch.

        Samples that overlap with the batch before are cut off, samples after a step that no
        door can make are dropped (see `JumpFilter`). Until the zero is known (the door has not
        stood still for long enough yet) nothing comes out.

        Args:
            batch: The batch.

        Returns:
            What can be believed of it: mostly one piece; none if the batch came late or twice,
            while the zero is not known, or while the count makes no sense.

        Raises:
            BadBatchError: The batch makes no sense; the decoder goes on as if it never came.
        """
        try:
            batch.check(self.settings.counts_per_turn)
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
            gap = self._gap or piece.after_jump
            self._gap = gap  # until something comes out
            if piece.new_level:
                self._forget_zero()
            zero = self._find_zero(values[piece.start :], piece.counts)
            if zero is None:
                continue
            start_ns = batch.stamp_ns + round(piece.start * batch.period * 1e9)
            counts = self.settings.direction * (piece.counts - round(zero))
            first = batch.first_index + piece.start
            decoded.append(Decoded(start_ns, batch.period, first, counts, gap))
            self._gap = False
        if len(pieces) == 1 and len(pieces[0].counts) == len(values):
            self._check_index(batch.index_values, pieces[0].counts, batch.period)
        return decoded

    def _placed(self, batch: Batch) -> tuple[Batch, float] | None:
        """A batch in the stream.

        Returns:
            The batch without what was heard before, its gap marked, and the time from the last
            sample before to its first [s], inf if not known; None if all of it was heard before.
        """
        values, first, gap = batch.values, batch.first_index, batch.gap_before
        stamp_ns, period_ns = batch.stamp_ns, batch.period * 1e9
        elapsed = math.inf if gap else batch.period
        if self._heard and self._restarted(batch):
            self.health.restarts += 1
            self._begin_anew()
            gap = True
        elif self._heard:
            missing = first - self._next_index
            if missing < 0:
                if -missing >= len(values):
                    self.health.late += 1
                    return None
                values, first = values[-missing:], self._next_index
                stamp_ns -= round(missing * period_ns)
                missing = 0
            self.health.lost += missing
            gap = gap or missing > 0
            elapsed += missing * batch.period
            drift_ns = stamp_ns - self._next_stamp_ns - missing * period_ns
            if abs(drift_ns) > _STAMP_SLACK_NS + 0.5 * period_ns:
                gap, elapsed = True, math.inf
        self._heard = True
        self._next_index = first + len(values)
        self._next_stamp_ns = stamp_ns + round(len(values) * period_ns)
        placed = replace(
            batch, first_index=first, stamp_ns=stamp_ns, values=values, gap_before=gap
        )
        return placed, elapsed

    def _bounded(self, batch: Batch) -> Counts:
        """The values, so small that differences do not overflow."""
        values = np.asarray(batch.values, dtype=np.int64)
        if self.settings.modulus:
            return np.asarray(values % self.settings.modulus)
        return np.clip(values, -LARGEST_COUNT, LARGEST_COUNT)

    def _restarted(self, batch: Batch) -> bool:
        """The sender began anew: its numbers go back while its time does not, or both far."""
        if batch.first_index >= self._next_index:
            return False
        ahead = batch.stamp_ns - self._next_stamp_ns
        return ahead >= 0 or ahead < -_RESTART_NS

    def _begin_anew(self) -> None:
        """Begin anew: a counter that was switched off has lost its zero."""
        self._filter.reset()
        self._forget_zero()

    def _forget_zero(self) -> None:
        """Nothing is known of the counter's level."""
        self.zero: float | None = None
        self.zero_in_doubt = False
        self.index.reset()
        self._still: list[int] = []

    def _check_index(self, latched: Sequence[int] | Counts, counts: Counts, period: float) -> None:
        """Compare where the index came with where it came before."""
        low, high = int(counts.min()), int(counts.max())
        near = self._filter.reach(period)
        for value in latched:
            count = self._filter.place(int(value))
            if not low - near <= count <= high + near:
                self.health.index_errors += 1  # noise: the door was not there
            elif self.index.reference is None:
                if not self.zero_in_doubt:  # else it would confirm what is in doubt
                    self.index.learn(count)
            else:
                self._compare_index(count)

    def _compare_index(self, count: int) -> None:
        """A passage tells how many counts were gained unseen."""
        passage = self.index.judge(count)
        self.health.index_errors += int(passage.error != 0)
        if passage.sure:
            self.zero_in_doubt = False
            if passage.error:
                self._filter.shift(passage.error)
                self._gap = True

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
