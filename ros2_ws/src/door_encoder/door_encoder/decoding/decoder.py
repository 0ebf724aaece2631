"""The decoder: checks batches of raw counter values and decodes them in the order of arrival."""

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from enum import IntEnum

import numpy as np
from door_model.recording.batch import SampleBatch
from door_model.recording.counts import LARGEST_COUNT, Counts, difference, stationary_zero

from door_encoder.decoding.jumps import JumpFilter
from door_encoder.decoding.settings import Settings
from door_encoder.errors import BadBatchError

TROUBLES = {
    "lost": "samples lost",  # according to the running numbers
    "gaps": "gaps",  # according to running numbers, stamps or the sender
    "late": "batches late or twice",
    "refused": "batches refused",
    "jumps": "implausible jumps",
    "dropped": "implausible samples dropped",
    "index_errors": "index elsewhere than before",
    "restarts": "restarts of the counter",
}
_RESTART_NS = 1_000_000_000  # a batch that is older by more than this comes from a new start [ns]
_STAMP_SLACK = 0.002  # jitter of stamps; more than this and half a period is a gap [s]
_PERIODS = (1e-5, 1.0)  # shortest and longest time between two samples [s]
_LAST_NUMBER = 2**63  # largest running number; the numbers after it still fit into a message
INDEX_TOLERANCE = 4  # [counts]; an index is as wide as a line, and is passed from either side


class EncoderDecoder:
    """Decodes batches of raw counts one after the other.

    Attributes:
        settings: Description of encoder, counter and door.
        health: Numbers of batches and samples, and of each of the `TROUBLES`, since the start.
        zero: Unwrapped count of the closed door; None until it is known.
        zero_in_doubt: Whether the counter has gained or lost counts, and no index pulse has
            confirmed yet how many.
        index: Unwrapped count at the index (Z) pulse, which comes once per turn and always at the
            same angle; None until the first passage.
    """

    def __init__(self, settings: Settings | None = None) -> None:
        self.settings = Settings() if settings is None else settings
        self.health = Counter(dict.fromkeys(("batches", "samples", *TROUBLES), 0))
        self._filter = JumpFilter(
            modulus=self.settings.modulus,
            max_rate=self.settings.max_speed / self.settings.radians_per_count,
            half_turn=self.settings.counts_per_turn // 2)
        self._last: SampleBatch | None = None  # newest batch
        self._gap = False  # whether samples are missing before the next output
        self._begin_anew()

    @property
    def offset(self) -> int:
        """Number of counts that are subtracted from the counter's value after jumps."""
        return self._filter.offset

    def decode(self, batch: SampleBatch) -> list[SampleBatch]:
        """Decode a batch of raw counts.

        Args:
            batch: Raw values of the counter.

        Returns:
            The samples that `JumpFilter` believes and that were not received before, as unwrapped,
            zeroed counts that are positive when the door opens. Usually this is one batch. It is
            none until the zero is known, which needs a door that stands still for `zero_samples`.

        Raises:
            BadBatchError: The batch cannot be used; the decoder's state stays as it was.
        """
        self._require_usable(batch)
        placed = self._placed(batch)
        if placed is None:
            return []
        batch, elapsed = placed
        # Limited so that differences do not overflow.
        values = (batch.counts % self.settings.modulus if self.settings.modulus
                  else np.clip(batch.counts, -LARGEST_COUNT, LARGEST_COUNT))
        offset = self.offset
        counts, believed = self._filter.take(values, batch.period, elapsed)
        if self.offset != offset:
            self.zero_in_doubt = self.offset != 0
        self.health.update(batches=1, samples=len(values), gaps=int(batch.gap_before),
                           dropped=int(np.count_nonzero(~believed)))
        self.health["jumps"] = self._filter.jumps
        self._gap = self._gap or batch.gap_before
        decoded, done = [], 0
        at = np.flatnonzero(believed)
        for part in np.split(at, np.flatnonzero(np.diff(at) > 1) + 1) if at.size else []:
            start, stop = int(part[0]), int(part[-1]) + 1
            self._gap, done = self._gap or start > done, stop
            zero = self._find_zero(int(values[start]), counts[start:stop])
            if zero is not None:
                decoded.append(replace(
                    batch,
                    stamp_ns=batch.stamp_ns + round(start * batch.period * 1e9),
                    first_index=batch.first_index + start,
                    counts=self.settings.direction * (counts[start:stop] - round(zero)),
                    gap_before=self._gap,
                    index_counts=np.empty(0, dtype=np.int64)))
                self._gap = False
        self._gap = self._gap or done < len(values)
        if believed.all():
            self._check_index(batch.index_counts, counts, batch.period)
        return decoded

    def _require_usable(self, batch: SampleBatch) -> None:
        """Raise BadBatchError if a batch cannot come from the configured encoder."""
        configured = self.settings.counts_per_turn
        for fits, quantity, value, limit in (
            (len(batch.counts) > 0, "number of samples", 0, 1),
            (_PERIODS[0] <= batch.period <= _PERIODS[1], "period [s]", batch.period, _PERIODS),
            (batch.first_index <= _LAST_NUMBER, "running number", batch.first_index, _LAST_NUMBER),
            (batch.counts_per_turn == configured, "resolution", batch.counts_per_turn, configured)):
            if not fits:
                self.health["refused"] += 1
                raise BadBatchError(quantity=f"the batch's {quantity}", value=value, limit=limit)

    def _placed(self, batch: SampleBatch) -> tuple[SampleBatch, float] | None:
        """Place a batch in the stream.

        Returns:
            The batch without the samples that were received before, with its gap marked; and the
            time from the last sample before to its first sample [s], infinite if not known. None
            if all its samples were received before.
        """
        elapsed = math.inf if batch.gap_before else batch.period
        if self._last is not None:
            due = self._last.first_index + len(self._last.counts)
            ahead_ns = batch.stamp_ns - self._last.end_ns
            missing = batch.first_index - due
            # The sender began anew if the running numbers go back and the time does not, if both
            # go back far, or if it says so: by number 0 behind a gap.
            if missing < 0 and (ahead_ns >= 0 or ahead_ns < -_RESTART_NS
                                or (batch.gap_before and not batch.first_index)):
                self.health["restarts"] += 1
                self._begin_anew()
                batch = replace(batch, gap_before=True)
            elif -missing >= len(batch.counts):
                self.health["late"] += 1
                return None
            else:
                lost, known = max(0, missing), max(0, -missing)
                self.health["lost"] += lost
                elapsed += lost * batch.period
                moved = abs(ahead_ns * 1e-9 - missing * batch.period) > (
                    _STAMP_SLACK + 0.5 * batch.period)
                if moved:
                    elapsed = math.inf
                batch = replace(
                    batch, first_index=batch.first_index + known, counts=batch.counts[known:],
                    stamp_ns=batch.stamp_ns + round(known * batch.period * 1e9),
                    gap_before=batch.gap_before or lost > 0 or moved)
        self._last = batch
        return batch, elapsed

    def _begin_anew(self) -> None:
        """Begin anew, because a counter that was switched off has lost its zero."""
        self._filter.reset()
        self.zero: float | None = None
        self.zero_in_doubt = False
        self.index: int | None = None
        self._suspect: int | None = None  # error of a single deviating passage [counts]
        self._still: list[int] = []  # newest unwrapped counts, which may be stationary

    def _check_index(self, latched: Counts, counts: Counts, period: float) -> None:
        """Compare the counts at which the index was latched with its known count.

        A single deviating passage may be noise on the index line. A second one in a row with the
        same error shows counts that were gained or lost unnoticed, which are then subtracted.
        """
        near = self._filter.reach(period)
        for value in latched.tolist():
            count = self._filter.place(value)
            if not counts.min() - near <= count <= counts.max() + near:
                self.health["index_errors"] += 1  # the door was not there: it is noise
                continue
            if self.index is None:
                if not self.zero_in_doubt:  # a first passage cannot confirm an offset
                    self.index = count
                continue
            error = difference(count, self.index, self.settings.counts_per_turn)
            fits = abs(error) <= INDEX_TOLERANCE
            again = self._suspect is not None and abs(error - self._suspect) <= INDEX_TOLERANCE
            self._suspect = None if fits or again else error
            self.health["index_errors"] += not fits
            if fits or again:
                self.zero_in_doubt = False
            if again and not fits:
                self._filter.shift(error)
                self._gap = True

    def _find_zero(self, value: int, counts: Counts) -> float | None:
        """Return the closed door's count, once known, from unwrapped counts and the first value."""
        keep, known = self.settings.zero_samples, self.settings.zero
        if self.zero is None and known is not None:
            # The first counter value decides how often the counter has wrapped since the zero.
            self.zero = float(counts[0] + difference(known, value, self.settings.modulus))
        for count in counts.tolist():
            if self.zero is not None:
                break
            self._still = [*self._still, count][-keep:]
            self.zero = stationary_zero(np.array(self._still), keep)
        return self.zero


_SILENCE = 0.5  # longest normal time without a batch [s]


class Level(IntEnum):
    """Severity of a verdict, numbered as in DiagnosticStatus."""

    OK = 0
    WARN = 1
    STALE = 3


def assess(
    decoder: EncoderDecoder, age: float, before: Mapping[str, int]
) -> tuple[Level, str, dict[str, str]]:
    """Judge what has happened since the report before.

    Args:
        decoder: The decoder.
        age: Time since the last batch [s].
        before: The decoder's health at the report before; empty for the first report.

    Returns:
        Severity, explanation in words, and running totals, zero, offset and index as texts.
    """
    totals = decoder.health
    state = {"zero": decoder.zero, "offset": decoder.offset, "index": decoder.index}
    values = {key: "unknown" if value is None else str(value)
              for key, value in {**totals, **state}.items()}
    new = {text: totals[key] - before.get(key, 0) for key, text in TROUBLES.items()}
    troubles = [f"{text}: {number}" for text, number in new.items() if number]
    if decoder.zero_in_doubt:
        troubles.append(
            f"zero in doubt: the count has jumped by {decoder.offset}; this offset is subtracted "
            "until the index confirms it or the counter is restarted")
    if age > _SILENCE:
        silence = f"no samples for {age:.1f} s" if totals["batches"] else "no samples yet"
        return Level.STALE, ", ".join([silence, *troubles]), values
    if decoder.zero is None and not troubles:
        troubles.append("no zero yet: waiting for the door to stand still")
    return Level.WARN if troubles else Level.OK, ", ".join(troubles) or "samples complete", values
