"""A verdict on the health of the encoder, in words."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from enum import Enum

from door_encoder.decoding.decoder import EncoderDecoder

_SILENCE = 0.5  # longest normal time without a batch [s]
_TROUBLES = {
    "lost": "samples lost",
    "gaps": "gaps",
    "late": "batches late or twice",
    "refused": "batches refused",
    "jumps": "implausible jumps",
    "dropped": "implausible samples dropped",
    "index_errors": "index elsewhere than before",
    "restarts": "restarts of the counter",
}


class Level(Enum):
    """Severity of a verdict."""

    OK = 0
    WARN = 1
    STALE = 2


@dataclass(frozen=True)
class Verdict:
    """A report on the encoder's health.

    Attributes:
        level: Severity.
        message: Explanation in words.
        values: Running totals, zero, offset and index as text.
        totals: Running totals, to be passed to the next call of `assess`.
    """

    level: Level
    message: str
    values: dict[str, str]
    totals: dict[str, int]


def assess(decoder: EncoderDecoder, age: float, before: Mapping[str, int]) -> Verdict:
    """Judge what has happened since the report before.

    Args:
        decoder: The decoder.
        age: Time since the last batch [s].
        before: The `totals` of the report before; empty for the first report.
    """
    totals = asdict(decoder.health)
    index = "unknown" if decoder.index.reference is None else str(decoder.index.reference)
    zero = "unknown" if decoder.zero is None else f"{decoder.zero:.1f}"
    values = {key: str(value) for key, value in totals.items()}
    values |= {"zero": zero, "offset": str(decoder.offset), "index": index}
    new = {key: totals[key] - before.get(key, 0) for key in _TROUBLES}
    troubles = [f"{_TROUBLES[key]}: {new[key]}" for key in _TROUBLES if new[key]]
    if decoder.zero_in_doubt:
        troubles.append(
            f"zero in doubt: the count has jumped by {decoder.offset}; this offset is subtracted "
            "until the index confirms it or the counter is restarted"
        )
    if age > _SILENCE:
        silence = "no samples yet" if not totals["batches"] else f"no samples for {age:.1f} s"
        return Verdict(Level.STALE, ", ".join([silence, *troubles]), values, totals)
    if troubles:
        return Verdict(Level.WARN, ", ".join(troubles), values, totals)
    if decoder.zero is None:
        message = "no zero yet: waiting for the door to stand still"
        return Verdict(Level.WARN, message, values, totals)
    return Verdict(Level.OK, "samples complete", values, totals)
