"""Steps of the count that no door can make."""

import math
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from door_model.recording.counts import Counts, difference, unwrap

CONFIRM = 0.005  # time after which a run that begins where the door can be is believed [s]
SETTLE = 0.1  # time after which a run that begins elsewhere is believed [s]
_UNSEEN = 3.0  # speed that a door may gain and lose again while it is not seen [rad/s]
_SLOPE = 20  # samples from which the door's speed after a jump is estimated


@dataclass(frozen=True)
class Piece:
    """Neighbouring samples of a batch that are believed to be the door's.

    Attributes:
        start: Place of the first sample in the batch.
        counts: Unwrapped counts (N,), from which the offset has been subtracted.
        after_jump: Whether samples before the first one were dropped.
        new_level: Whether the counter's value was accepted as it is: this holds for the very
            first samples, and again after a jump that came before the first level had lasted for
            `SETTLE`.
    """

    start: int
    counts: Counts
    after_jump: bool = False
    new_level: bool = False


@dataclass(frozen=True)
class _Run:
    """Neighbouring samples of a batch without an impossible step between them.

    Attributes:
        values: Counter values (N,).
        period: Time between two samples [s].
        elapsed: Time from the sample before to the first of these [s]; infinite if not known.
        follows: Whether the step from the sample before may be possible. It is False where an
            impossible step inside the batch separates the run from the sample before.
    """

    values: Counts
    period: float
    elapsed: float
    follows: bool


@dataclass(frozen=True)
class _Start:
    """State before the first sample: the counter's level is not known."""


@dataclass(frozen=True)
class _Believing:
    """State while the samples are believed.

    Attributes:
        count: Unwrapped count of the last believed sample.
        offset: Counts that are subtracted from the counter's value.
        lasted: Time for which the counter's level has been believed [s].
    """

    count: int
    offset: int = 0
    lasted: float = 0.0


@dataclass
class _Doubting:
    """State while a run of samples may be noise.

    Attributes:
        level: State in which the last believed sample left the filter.
        candidate: Offset with which the run begins where the door can be; None if none does.
        only_gap: Whether the run began after a gap and without a jump.
        away_at_start: Time from the last believed sample to the first one of the run [s].
        away: Time from the last believed sample to the last sample [s].
        values: Counter values of the run.
    """

    level: _Believing
    candidate: int | None
    only_gap: bool
    away_at_start: float
    away: float
    values: list[int] = field(default_factory=list)


class JumpFilter:
    """Unwraps a stream of counter values and drops what cannot be the door's motion.

    The filter is in one of three states: `_Start`, `_Believing` or `_Doubting`.

    A step faster than the door's greatest speed begins a run of doubtful samples, and so does a
    gap after which the count is elsewhere. There are two ways back to belief:

    - If the door can have reached the start of the run, and its speed in the run explains the
      distance, the run is believed after `CONFIRM`: the samples before it were noise.
    - A run that begins elsewhere and lasts for `SETTLE` is the door's as well, on a counter that
      has gained or lost counts. A door cannot jump, so the offset is subtracted. The offset is
      uncertain by the door's motion in the meantime, which is estimated from its speed.

    After a gap of unknown length the door may be anywhere within half a turn.

    Attributes:
        jumps: Number of steps that no door can make.
        dropped: Number of samples that were dropped.
    """

    def __init__(self, *, modulus: int, max_rate: float, half_turn: int) -> None:
        """Set the properties of counter and door.

        Args:
            modulus: Number of counts after which the counter wraps; 0 if it never does.
            max_rate: Greatest speed of the door [counts/s].
            half_turn: Number of counts in half a turn.
        """
        self._modulus = modulus
        self._max_rate = max_rate
        self._half_turn = half_turn
        self._unseen_rate = _UNSEEN * half_turn / math.pi
        self.jumps = self.dropped = 0
        self.reset()

    def reset(self) -> None:
        """Forget the counter's level, as after the counter was switched off."""
        self._state: _Start | _Believing | _Doubting = _Start()

    @property
    def offset(self) -> int:
        """Number of counts that are subtracted from the counter's value."""
        return 0 if isinstance(self._state, _Start) else self._level.offset

    def reach(self, time: float) -> float:
        """Return the number of counts that the door can move in a time [s], and one for flicker."""
        return min(self._max_rate * time, self._half_turn) + 1.0

    def place(self, value: int) -> int:
        """Return the unwrapped count of a value near the last believed sample, which must exist."""
        level = self._level
        return level.count + self._distance(value, level, level.offset)

    def shift(self, counts: int) -> None:
        """Subtract counts that the counter has gained unnoticed (negative: lost) from now on."""
        level = replace(
            self._level, offset=self._level.offset + counts, count=self._level.count - counts
        )
        if isinstance(self._state, _Doubting):
            self._state.level = level
        else:
            self._state = level

    def take(self, values: Counts, period: float, elapsed: float) -> list[Piece]:
        """Filter neighbouring samples; the result does not depend on where a stream is cut.

        Args:
            values: Counter values (N,).
            period: Time between two samples [s].
            elapsed: Time from the last sample before to the first of these [s]; infinite if it is
                not known.

        Returns:
            The believed samples, in order of time.
        """
        steps = np.diff(unwrap(values, self._modulus))
        breaks = np.flatnonzero(np.abs(steps) > self.reach(period)) + 1
        pieces: list[Piece] = []
        for start, stop in pairwise([0, *breaks.tolist(), len(values)]):
            time = period if start else elapsed
            piece = self._advance(_Run(values[start:stop], period, time, follows=not start))
            if piece is None:
                self.dropped += stop - start
                continue
            self.dropped += piece.start
            pieces.append(replace(piece, start=start + piece.start))
        return pieces

    @property
    def _level(self) -> _Believing:
        """State of the last believed sample, which must exist."""
        if isinstance(self._state, _Doubting):
            return self._state.level
        assert isinstance(self._state, _Believing)
        return self._state

    def _advance(self, run: _Run) -> Piece | None:
        """Handle a run in the present state, and change to the next state."""
        state, first = self._state, int(run.values[0])
        if isinstance(state, _Start):
            return self._accept_level(run.values, run.period)
        if isinstance(state, _Believing):
            step = self._distance(first, state, state.offset)
            if run.follows and abs(step) <= self.reach(run.period):
                return self._believe(state, run.values, run.period)
            return self._begin_doubt(state, run, run.elapsed)
        state.away += run.elapsed
        step = difference(first, state.values[-1], self._modulus)
        if run.follows and math.isfinite(run.elapsed) and abs(step) <= self.reach(run.elapsed):
            return self._go_on_doubting(state, run)
        return self._begin_doubt(state.level, run, state.away)

    def _accept_level(self, values: Counts, period: float) -> Piece:
        """Believe the counter's value as it is."""
        piece = self._believe(_Believing(int(values[0])), values, period)
        return replace(piece, new_level=True)

    def _believe(self, level: _Believing, values: Counts, period: float) -> Piece:
        """Believe values that go on from a level."""
        counts = unwrap(values - level.offset, self._modulus, (level.count, level.count))
        lasted = level.lasted + len(values) * period
        self._state = _Believing(int(counts[-1]), level.offset, lasted)
        return Piece(0, counts)

    def _begin_doubt(self, level: _Believing, run: _Run, away: float) -> Piece | None:
        """Begin a run of doubtful samples, `away` seconds after the last believed one."""
        candidate = self._candidate(level, int(run.values[0]), away)
        after_gap = run.follows and run.elapsed > 1.5 * run.period
        only_gap = after_gap and candidate is not None
        self.jumps += not only_gap
        return self._go_on_doubting(_Doubting(level, candidate, only_gap, away, away), run)

    def _go_on_doubting(self, doubt: _Doubting, run: _Run) -> Piece | None:
        """Add samples to a doubtful run; believe those from which on it has lasted long enough."""
        self._state = doubt
        before, values, period = len(doubt.values), run.values, run.period
        doubt.values += values.tolist()
        doubt.away += (len(values) - 1) * period
        confirmed = _samples(CONFIRM, period)
        if len(doubt.values) >= confirmed and not self._explained(doubt, confirmed, period):
            doubt.candidate = None
        size = _samples(SETTLE, period) if doubt.candidate is None else confirmed
        skip = size - 1 - before
        if skip >= len(values):
            return None
        if doubt.candidate is not None:
            if doubt.only_gap and not before:
                skip = 0  # There was no jump: the first samples of the batch need not be dropped.
            level = replace(doubt.level, offset=doubt.candidate)
            piece = self._believe(level, values[skip:], period)
        elif doubt.level.lasted < SETTLE:
            piece = self._accept_level(values[skip:], period)
        else:
            piece = self._believe(self._shifted_level(doubt, size, period), values[skip:], period)
        return replace(piece, start=skip, after_jump=True)

    def _candidate(self, level: _Believing, value: int, away: float) -> int | None:
        """Return the offset, the present one or 0, with which the door can have reached a value."""
        for offset in (level.offset, 0):
            if abs(self._distance(value, level, offset)) <= self.reach(away):
                return offset
        return None

    def _distance(self, value: int, level: _Believing, offset: int) -> int:
        """Return the number of counts from the last believed sample to a value with an offset."""
        return difference(value - offset, level.count, self._modulus)

    def _slope(self, doubt: _Doubting, size: int, period: float) -> float:
        """Return the speed of the door at the start of a run [counts/s]."""
        head = unwrap(np.array(doubt.values[: min(size, _SLOPE)]), self._modulus)
        return int(head[-1] - head[0]) / (len(head) - 1) / period

    def _explained(self, doubt: _Doubting, size: int, period: float) -> bool:
        """Return whether the door's speed explains the distance that it moved while not seen."""
        if doubt.candidate is None:
            return False
        time = doubt.away_at_start
        if not math.isfinite(time):
            return True
        moved = self._distance(doubt.values[0], doubt.level, doubt.candidate)
        change = self._unseen_rate * time + self.reach(period)
        return abs(moved - self._slope(doubt, size, period) * time) <= change

    def _shifted_level(self, doubt: _Doubting, size: int, period: float) -> _Believing:
        """Return a level whose offset puts the run where the door must be."""
        run = unwrap(np.array(doubt.values[:size], dtype=np.int64), self._modulus)
        moved = self._slope(doubt, size, period) * min(doubt.away_at_start, SETTLE)
        start = doubt.level.count + round(moved)
        offset = difference(int(run[0]), start, self._modulus)
        return replace(doubt.level, offset=offset, count=start + int(run[-1] - run[0]))


def _samples(time: float, period: float) -> int:
    """Return the number of samples, at least two, that last for a time [s]."""
    return max(2, math.ceil(time / period - 1e-6))
