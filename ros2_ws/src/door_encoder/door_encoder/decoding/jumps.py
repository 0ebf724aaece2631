"""Steps of the count that no door can make."""

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from door_encoder.decoding.counts import Counts, difference, unwrap

CONFIRM = 0.005  # [s] a count must go on plausibly where the door can be, to be believed
SETTLE = 0.1  # [s] and where it cannot be
_UNSEEN = 3.0  # [rad/s] that a door may gain and lose again while it is not seen
_SLOPE = 20  # samples that tell how fast the door moves behind a jump


@dataclass(frozen=True)
class Piece:
    """Neighbouring samples of a batch that can be believed.

    Attributes:
        start: Place of the first one in the batch.
        counts: Unwrapped counts (N,), offsets taken out.
        after_jump: Samples before it were dropped.
        new_level: The counter's level was taken as it is: the first samples of all, and again
            where a jump came before the first level had lasted for `SETTLE`.
    """

    start: int
    counts: Counts
    after_jump: bool = False
    new_level: bool = False


class JumpFilter:
    """Unwraps a stream of counter values and keeps back what cannot be the door.

    A step faster than the door's greatest speed begins a run of doubtful samples, and so does a
    gap after which the count is elsewhere. A run that begins where the door can be by then, at
    about the speed that it has there, is believed when it has gone on plausibly for `CONFIRM`:
    before it there was noise. A run that begins elsewhere and goes on for `SETTLE` is the door as
    well, on a counter that has gained or lost counts: since a door cannot jump, the offset is taken
    out, up to what the door's motion meanwhile leaves open. Behind a gap of unknown length the door
    may be anywhere within half a turn.

    Attributes:
        offset: Counts taken out of the counter's value so far.
        jumps: Steps that no door can make.
        dropped: Samples kept back.
        believed: Whether the last sample was.
    """

    def __init__(self, *, modulus: int, max_rate: float, half_turn: int) -> None:
        """Set what counter and door can do.

        Args:
            modulus: Counts after which the counter wraps; 0 if it never does.
            max_rate: Greatest speed of the door [counts/s].
            half_turn: Counts of half a turn.
        """
        self._modulus = modulus
        self._max_rate = max_rate
        self._half_turn = half_turn
        self._unseen_rate = _UNSEEN * half_turn / math.pi
        self.jumps = self.dropped = 0
        self.reset()

    def reset(self) -> None:
        """Forget the counter's level, as when it was switched off."""
        self.offset = 0
        self._count: int | None = None  # the last believed one
        self._lasted = 0.0  # how long the level has been believed [s]
        self._doubtful: list[int] = []  # values of the present run
        self._candidate: int | None = None  # offset with which it is where the door can be
        self._only_gap = False  # it began behind a gap, and without a jump
        self._away = 0.0  # from the last believed sample to the last sample [s]
        self._away_at_start = 0.0  # and to the first of the run

    @property
    def believed(self) -> bool:
        """Whether the last sample was believed."""
        return not self._doubtful

    def reach(self, time: float) -> float:
        """Counts that the door can move in a time [s], and one for its flicker."""
        return min(self._max_rate * time, self._half_turn) + 1.0

    def place(self, value: int) -> int:
        """Count of a counter value near the last believed sample, which there must be."""
        assert self._count is not None
        return self._count + self._off(value, self.offset)

    def shift(self, counts: int) -> None:
        """Take out counts that were gained unseen (negative: lost)."""
        assert self._count is not None
        self.offset += counts
        self._count -= counts

    def take(self, values: Counts, period: float, elapsed: float) -> list[Piece]:
        """Take up neighbouring samples; cutting a stream elsewhere makes no difference.

        Args:
            values: Counter values (N,).
            period: Time between two of them [s].
            elapsed: From the last sample before to the first of them [s]; inf if not known.

        Returns:
            What can be believed, in order.
        """
        steps = np.diff(unwrap(values, self._modulus))
        breaks = np.flatnonzero(np.abs(steps) > self.reach(period)) + 1
        pieces: list[Piece] = []
        for start, stop in pairwise([0, *breaks.tolist(), len(values)]):
            time = period if start else elapsed
            piece = self._run(values[start:stop], period, time, follows=not start)
            if piece is None:
                self.dropped += stop - start
                continue
            self.dropped += piece.start
            pieces.append(replace(piece, start=start + piece.start))
        return pieces

    def _run(self, run: Counts, period: float, time: float, *, follows: bool) -> Piece | None:
        """What can be believed of values without a jump among them.

        Args:
            run: The values.
            period: Time between two of them [s].
            time: From the sample before to the first of them [s].
            follows: Whether they may go on from the sample before.
        """
        first = int(run[0])
        if self._count is None:
            self._count = first
            return replace(self._believe(run, period), new_level=True)
        self._away += time
        if follows and self._doubtful:
            step = difference(first, self._doubtful[-1], self._modulus)
            if math.isfinite(time) and abs(step) <= self.reach(time):
                return self._doubt(run, period)
        elif follows and abs(self._off(first, self.offset)) <= self.reach(period):
            return self._believe(run, period)
        after_gap = follows and time > 1.5 * period
        self._doubtful = []
        self._away_at_start = self._away
        self._candidate = self._return(first)
        self._only_gap = after_gap and self._candidate is not None
        self.jumps += not self._only_gap
        return self._doubt(run, period)

    def _return(self, value: int) -> int | None:
        """The offset with which a value is where the door can be by now: the present one or 0."""
        for offset in (self.offset, 0):
            if abs(self._off(value, offset)) <= self.reach(self._away):
                return offset
        return None

    def _off(self, value: int, offset: int) -> int:
        """Counts between a value with an offset and the last believed sample."""
        assert self._count is not None
        return difference(value - offset, self._count, self._modulus)

    def _believe(self, run: Counts, period: float) -> Piece:
        """The run is the door."""
        assert self._count is not None
        last = (self._count, self._count)
        counts = unwrap(run - self.offset, self._modulus, last)
        self._count = int(counts[-1])
        self._doubtful = []
        self._away = 0.0
        self._lasted += len(run) * period
        return Piece(0, counts)

    def _doubt(self, run: Counts, period: float) -> Piece | None:
        """The run may be noise, until it has lasted."""
        assert self._count is not None
        before = len(self._doubtful)
        self._doubtful += run.tolist()
        self._away += (len(run) - 1) * period
        size = _samples(SETTLE, period)
        if self._candidate is not None:
            size = _samples(CONFIRM, period)
            if len(self._doubtful) < size:
                return None
            if not self._explained(size, period):
                self._candidate = None
                size = _samples(SETTLE, period)
        skip = size - 1 - before
        if skip >= len(run):
            return None
        if self._only_gap and self._candidate is not None and not before:
            skip = 0  # no jump was seen: what the batch has of it need not be dropped
        believable = run[skip:]
        new_level = self._candidate is None and self._lasted < SETTLE
        if new_level:
            self.reset()
            self._count = int(believable[0])
        elif self._candidate is None:
            self._take_out_offset(size, period)
        else:
            self.offset = self._candidate
        piece = self._believe(believable, period)
        return replace(piece, start=skip, after_jump=True, new_level=new_level)

    def _slope(self, size: int, period: float) -> float:
        """How fast the door moves at the start of the run [counts/s]."""
        head = unwrap(np.array(self._doubtful[: min(size, _SLOPE)]), self._modulus)
        return int(head[-1] - head[0]) / (len(head) - 1) / period

    def _explained(self, size: int, period: float) -> bool:
        """Whether the door's speed now explains where it has got to while it was not seen."""
        time = self._away_at_start
        if not math.isfinite(time):
            return True
        assert self._candidate is not None
        moved = self._off(self._doubtful[0], self._candidate)
        change = self._unseen_rate * time + self.reach(period)
        return abs(moved - self._slope(size, period) * time) <= change

    def _take_out_offset(self, size: int, period: float) -> None:
        """The first samples of the run are where the door is by now."""
        assert self._count is not None
        run = unwrap(np.array(self._doubtful[:size], dtype=np.int64), self._modulus)
        moved = self._slope(size, period) * min(self._away_at_start, SETTLE)
        start = self._count + round(moved)
        self.offset = difference(int(run[0]), start, self._modulus)
        self._count = start + int(run[-1] - run[0])


def _samples(time: float, period: float) -> int:
    """Samples, two or more, that last for a time."""
    return max(2, math.ceil(time / period - 1e-6))
