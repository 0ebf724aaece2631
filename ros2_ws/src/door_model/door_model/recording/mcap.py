"""Reads recordings of the door's encoder from MCAP files, also those of `ros2 bag record`."""

import math
import struct
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import zstandard
from door_impact_common.errors import InputError
from door_impact_common.files import LARGEST_FILE, read_file, shown
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from door_model.errors import BadRecordingError, DoorParameterError
from door_model.recording.batch import SampleBatch, to_batch
from door_model.recording.recording import Recording, read_csv
from door_model.recording.sample_store import SampleStore

SAMPLES = "/door_encoder/samples"
COUNTS = "/door_encoder/counts"
_TYPE = "door_impact_msgs/msg/EncoderSamples"
_ZSTD = b"\x28\xb5\x2f\xfd"  # what zstd has compressed begins so; CDR begins with 0
_NO_SCHEMA = Schema(id=0, data=b"", encoding="", name="")
_CONVERT = "`rosbags-convert --src FILE --dst NEW_FOLDER --dst-storage mcap` converts it"
_OTHERS = {b"#ROSBAG V": "a bag of ROS 1", b"SQLite format 3": "a bag of ROS 2 in SQLite (.db3)"}


class Connection(NamedTuple):
    """A topic of a recording, and type and encoding of its messages."""

    topic: str
    msgtype: str
    encoding: str


class Bag:
    """A recording, which is read in the order in which it was written.

    A file that was cut off, as that of a recorder that was killed, is read up to its end. What
    `ros2 bag record --compression-mode message` or `file` made is read as well.

    Attributes:
        connections: Topics with messages.
    """

    def __init__(self, files: Sequence[bytes]) -> None:
        """Find the topics in the contents of MCAP files, in order of time."""
        self._files = files
        self._store = get_typestore(Stores.EMPTY)
        self._texts: dict[str, bytes] = {}  # definitions of types
        found = dict[Connection, None]()
        for schema, channel, _ in self._scan():
            self._texts[schema.name] = schema.data
            found[_connection(channel, schema)] = None
        self.connections = list(found)

    def messages(
        self, connections: Iterable[Connection]
    ) -> Iterator[tuple[Connection, int, bytes]]:
        """Yield topic, time of recording [ns] and content of each message on some topics."""
        wanted = set(connections)
        for schema, channel, message in self._scan():
            found = _connection(channel, schema)
            if found in wanted:
                yield found, message.log_time, _unpacked(message.data)

    def deserialize(self, data: bytes, kind: str) -> Any:
        """Return the message of a type that a content is."""
        if kind not in self._store.fielddefs:
            self._store.register(get_types_from_msg(self._texts[kind].decode(), kind))
        return self._store.deserialize_cdr(data, kind)

    def _scan(self) -> Iterator[tuple[Schema, Channel, Message]]:
        """Yield schema, channel and message of each message."""
        for content in self._files:
            schemas, channels = dict[int, Schema](), dict[int, Channel]()
            for record in _records(content):
                if isinstance(record, Schema):
                    schemas[record.id] = record
                elif isinstance(record, Channel):
                    channels[record.id] = record
                elif isinstance(record, Message):
                    channel = channels[record.channel_id]
                    yield schemas.get(channel.schema_id, _NO_SCHEMA), channel, record


def _connection(channel: Channel, schema: Schema) -> Connection:
    """Return the topic of a message, which may have no schema, as in JSON."""
    return Connection(channel.topic, schema.name, channel.message_encoding)


def _records(content: bytes) -> Iterator[McapRecord]:
    """Yield the records of a file, also those of a chunk that was cut off."""
    stream, end = BytesIO(content), 0
    try:
        for record in StreamReader(stream, emit_chunks=True, validate_crcs=True).records:
            end = stream.tell()
            if isinstance(record, Chunk):
                yield from breakup_chunk(record, validate_crc=True)
            else:
                yield record
    except Exception:
        if stream.read(1):  # otherwise the file was cut off here
            raise
    else:
        return
    if content[end : end + 1] != bytes([Opcode.CHUNK]):
        return
    try:
        chunk = Chunk.read(ReadDataStream(BytesIO(content[end + 9 :])))
        if chunk.compression != "lz4":  # its beginning alone cannot be read
            yield from StreamReader(BytesIO(_unpacked(chunk.data)), skip_magic=True).records
    except (EndOfFile, struct.error):
        return


def _unpacked(data: bytes) -> bytes:
    """Return what zstd compressed, as far as it is there; other data as they are."""
    if not data.startswith(_ZSTD):
        return data
    found = zstandard.ZstdDecompressor().stream_reader(BytesIO(data)).read(LARGEST_FILE + 1)
    if len(found) > LARGEST_FILE:
        raise InputError("the file", f"has more than {1e-6 * LARGEST_FILE:g} MB uncompressed")
    return found


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
            source, None, f"is no MCAP file of ROS 2, or damaged ({type(error).__name__}): "
            "`mcap recover` keeps what can be read of a damaged one",
            value=source, limit="an MCAP file") from error


def _contents(path: Path) -> list[bytes]:
    """Read a file, or the files of a folder in the order of their numbers.

    Raises:
        InputError: A file cannot be read, there is none, or all together are too large.
    """
    if not path.is_dir():
        content = _unpacked(read_file(path))
        for start, kind in _OTHERS.items():
            if content.startswith(start):
                raise InputError(shown(path), f"is {kind}, no MCAP file: {_CONVERT}")
        return [content]
    contents, left = list[bytes](), LARGEST_FILE
    files = [*path.glob("*.mcap"), *path.glob("*.mcap.zstd")]
    for file in sorted(files, key=lambda each: (len(each.name), each.name)):
        contents.append(_unpacked(read_file(file, largest=left)))
        left -= len(contents[-1])
    if not contents:
        raise InputError(
            shown(path),
            f"is a folder without an MCAP file: record with `-s mcap`; {_CONVERT}")
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
            encodings = {connection.encoding for connection in connections}
            if encodings != {"cdr"}:
                raise BadRecordingError(
                    source, None, f"{topic} has messages in {', '.join(sorted(encodings))}, must "
                    "be cdr, as ROS 2 writes them: record with `ros2 bag record -s mcap`",
                    value=encodings, limit="cdr")
            if kinds != {_TYPE}:
                raise BadRecordingError(
                    source, None, f"{topic} has {', '.join(sorted(kinds))}, not {_TYPE}",
                    value=kinds, limit=_TYPE)
            return topic, [to_batch(bag.deserialize(data, _TYPE))
                           for _, _, data in bag.messages(connections)]
    listed = ", ".join(sorted(there)) or "none (nothing was recorded, or it was cut off before)"
    raise BadRecordingError(
        source, None,
        f"has no messages on {' or '.join(topics)} (--topic takes another one); topics "
        f"with messages: {listed}",
        value=listed, limit=topics)


def read_mcap(path: str | Path, topic: str | None = None) -> Recording:
    """Read a recording from `/door_encoder/samples`, or else from `/door_encoder/counts`.

    Samples are already checked, unwrapped and zeroed; raw counts become angles as `sensor.opening`
    describes. Late and duplicated batches are dropped. Gaps show in the sample times. If the time
    goes back, because a simulation was reset, the recording begins anew.

    Args:
        path: As for `open_bag`.
        topic: The topic instead, as of a namespaced robot; if its name does not end with
            "samples", its counts are raw.

    Returns:
        The recording; its times begin at 0.

    Raises:
        BadRecordingError: The file cannot be read, or has no such topic.
        DoorParameterError: A batch has no positive period or counts_per_turn.
    """
    found, batches = read_batches(
        path, (f"/{topic.removeprefix('/')}",) if topic else (SAMPLES, COUNTS))
    store = SampleStore(math.inf)
    for batch in batches:
        store.add(batch)
    return store.recording(raw=not found.endswith("samples"))


def read_recording(path: str | Path, counts_per_turn: int | None = None) -> Recording:
    """Read a recording from an MCAP file or a folder of them, or else from a CSV file.

    Args:
        path: As for `open_bag`, or a CSV file.
        counts_per_turn: As for `read_csv`.

    Raises:
        BadRecordingError: The file cannot be read or used.
    """
    try:
        if Path(path).suffix in (".mcap", ".zstd") or Path(path).is_dir():
            return read_mcap(path)
        return read_csv(path, counts_per_turn)
    except DoorParameterError as error:
        raise BadRecordingError(
            shown(path), None, str(error), value=error.value, limit=error.limit) from error
