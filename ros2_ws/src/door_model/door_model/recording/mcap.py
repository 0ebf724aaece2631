"""Reads recordings of the door's encoder from MCAP files, also those of `ros2 bag record`."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from door_impact_common.errors import InputError
from door_impact_common.files import LARGEST_FILE, read_file, shown
from mcap.reader import NonSeekingReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from door_model.errors import BadRecordingError
from door_model.recording.batch import SampleBatch
from door_model.recording.counts import unwrap
from door_model.recording.recording import Recording
from door_model.recording.sample_store import SampleStore

SAMPLES = "/door_encoder/samples"
COUNTS = "/door_encoder/counts"
_TYPE = "door_impact_msgs/msg/EncoderSamples"
_FOREVER = 1e9  # time for which samples are kept, longer than any recording [s]
_MODULUS = 2**16  # counters of 16 bits or more agree modulo this number of counts
_SHUT = 20  # number of samples at the start that give the zero of raw counts


class Connection(NamedTuple):
    """A topic of a recording, the type of its messages and their number."""

    topic: str
    msgtype: str
    msgcount: int


class Bag:
    """A recording, which is read in the order in which it was written.

    A file that was cut off, as that of a recorder that was killed, is read up to its end.

    Attributes:
        connections: Topics with messages.
    """

    def __init__(self, files: Sequence[bytes]) -> None:
        """Count the messages in the contents of MCAP files, in order of time."""
        self._files = files
        self._store = get_typestore(Stores.EMPTY)
        self._texts: dict[str, str] = {}  # definitions of types
        counts = Counter[tuple[str, str]]()
        for schema, channel, _ in self._scan():
            self._texts[schema.name] = schema.data.decode()
            counts[channel.topic, schema.name] += 1
        self.connections = [Connection(*key, number) for key, number in counts.items()]

    def messages(
        self, connections: Iterable[Connection]
    ) -> Iterator[tuple[Connection, int, bytes]]:
        """Yield topic, time of recording [ns] and content of each message on some topics."""
        wanted = {(each.topic, each.msgtype): each for each in connections}
        for schema, channel, message in self._scan():
            found = wanted.get((channel.topic, schema.name))
            if found is not None:
                yield found, message.log_time, message.data

    def deserialize(self, data: bytes, kind: str) -> Any:
        """Return the message of a type that a content is."""
        if kind not in self._store.fielddefs:
            self._store.register(get_types_from_msg(self._texts[kind], kind))
        return self._store.deserialize_cdr(data, kind)

    def _scan(self) -> Iterator[tuple[Any, Any, Any]]:
        """Yield schema, channel and message of each message."""
        for content in self._files:
            stream = BytesIO(content)
            reader = NonSeekingReader(stream, validate_crcs=True)
            try:
                for schema, channel, message in reader.iter_messages(log_time_order=False):
                    if schema is not None:
                        yield schema, channel, message
            except Exception:
                if stream.read(1):  # otherwise the file was cut off here
                    raise


@contextmanager
def open_bag(path: str | Path) -> Iterator[Bag]:
    """Open a recording for reading.

    Args:
        path: An MCAP file, or a folder with MCAP files that `ros2 bag record` has made.

    Raises:
        BadRecordingError: The file cannot be read, or what is read within the context is damaged.
    """
    source = shown(path)
    try:
        yield Bag(_contents(Path(path)))
    except BadRecordingError:
        raise
    except InputError as error:
        raise BadRecordingError(
            source, None, error.problem, value=source, limit="a readable file") from error
    except Exception as error:  # the libraries raise many kinds where a file is damaged
        raise BadRecordingError(
            source, None, f"is no MCAP file of ROS 2, or damaged ({type(error).__name__})",
            value=source, limit="an MCAP file") from error


def _contents(path: Path) -> list[bytes]:
    """Read a file, or the files of a folder in the order of their numbers.

    Raises:
        InputError: A file cannot be read, there is none, or all together are too large.
    """
    if not path.is_dir():
        return [read_file(path)]
    contents, left = list[bytes](), LARGEST_FILE
    for file in sorted(path.glob("*.mcap"), key=lambda each: (len(each.name), each.name)):
        contents.append(read_file(file, largest=left))
        left -= len(contents[-1])
    if not contents:
        raise InputError(shown(path), "is a folder without an MCAP file")
    return contents


def read_batches(path: str | Path, topics: Sequence[str]) -> tuple[str, list[SampleBatch]]:
    """Read the batches of the first of several topics that has any.

    Args:
        path: As for `open_bag`.
        topics: Names of topics of type EncoderSamples, the preferred one first.

    Returns:
        The topic and its batches, in the order in which they were received.

    Raises:
        BadRecordingError: The file cannot be read, or has no message on these topics.
    """
    source = shown(path)
    with open_bag(path) as bag:
        there = {connection.topic for connection in bag.connections}
        topic = next((name for name in topics if name in there), None)
        if topic is not None:
            connections = [each for each in bag.connections if each.topic == topic]
            kinds = {connection.msgtype for connection in connections}
            if kinds != {_TYPE}:
                raise BadRecordingError(
                    source, None, f"{topic} has {', '.join(sorted(kinds))}, not {_TYPE}",
                    value=kinds, limit=_TYPE)
            return topic, [_batch(bag.deserialize(data, _TYPE))
                           for _, _, data in bag.messages(connections)]
    listed = ", ".join(sorted(there)) or "none"
    raise BadRecordingError(
        source, None,
        f"has no messages on {' or '.join(topics)}; topics with messages: {listed}",
        value=listed, limit=topics)


def read_mcap(path: str | Path) -> Recording:
    """Read a recording from `/door_encoder/samples`, or else from `/door_encoder/counts`.

    Samples are already checked, unwrapped and zeroed. Raw counts are unwrapped only, without a
    check. Their zero and direction follow from the door, which must be shut at the start of the
    recording and open from there; the counter must wrap at 2^16 counts or a multiple of them, or
    never. Late and duplicated batches are dropped. Gaps show in the sample times. If the time goes
    back, because a simulation was reset, the recording begins anew.

    Args:
        path: As for `open_bag`.

    Returns:
        The recording; its times begin at 0.

    Raises:
        BadRecordingError: The file cannot be read, or has no such topic.
        DoorParameterError: A batch has no positive period or counts_per_turn.
    """
    topic, batches = read_batches(path, (SAMPLES, COUNTS))
    store = SampleStore(_FOREVER)
    for batch in batches if topic == SAMPLES else _unwrapped(batches):
        store.add(batch)
    recording = store.recording()
    if topic == SAMPLES or not recording.t.size:
        return recording
    # Live decoding waits until the door stands still (`stationary_zero`); a recording must give a
    # zero whatever it begins with, and `checks.zero_doubts` reports a zero that looks wrong.
    theta = recording.theta - np.median(recording.theta[:_SHUT])
    if -theta.min() > theta.max():
        theta = -theta
    return Recording(recording.t, theta, recording.resolution)


def _unwrapped(batches: Iterable[SampleBatch]) -> Iterator[SampleBatch]:
    """Unwrap the counts of batches, from one batch to the next."""
    last: tuple[int, int] | None = None
    for batch in batches:
        values = batch.counts % _MODULUS
        counts = unwrap(values, _MODULUS, last)
        if len(counts):
            last = int(values[-1]), int(counts[-1])
        yield replace(batch, counts=counts)


def _batch(message: Any) -> SampleBatch:
    """Return the batch of a message as rosbags deserializes it."""
    stamp = message.header.stamp
    return SampleBatch(
        stamp_ns=stamp.sec * 1_000_000_000 + stamp.nanosec,
        period=message.period,
        first_index=message.first_index,
        counts_per_turn=message.counts_per_turn,
        counts=message.counts,
        gap_before=message.gap_before,
        # Older recordings were made before the message had this field.
        index_counts=getattr(message, "index_counts", np.empty(0, dtype=np.int64)),
    )
