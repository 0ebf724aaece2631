"""Writes a recording as one MCAP file, in the form in which rosbag2 writes and reads it.

The format is written by the library rosbags; this module adds what the recorder needs beyond it: a
single file that stands under its name only when it is complete, the hash of each message type,
valid times in a recording without messages, and a readable file where the disk becomes full.

`ros2 bag record` cannot take its place: it writes a folder, and when it is killed an incomplete
file stands under the final name.
"""

import shutil
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO, FileIO
from pathlib import Path
from typing import Any, Final

from door_impact_common.errors import SettingError
from rosbags.interfaces import Connection, Qos
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer, WriterError
from rosbags.rosbag2.storage_mcap import (
    Channel,
    McapWriter,
    PendingChunk,
    write_channel,
    write_string,
)
from rosbags.typesys.store import Typestore

from door_impact_bringup.errors import McapWriteError

SUFFIX = ".mcap"
_VERSION: Final = 9  # version of rosbag2's metadata, that of Jazzy


class McapFile:
    """A recording that is being written; `close` completes it and puts it under its name.

    Until then it grows in the folder ``NAME.mcap.partial`` next to it, where the recorder leaves it
    if it is killed. Memory stays bounded: chunks of about 1 MiB are compressed and written.

    Args:
        path: File to write, ``NAME.mcap``; missing folders above it are made.

    Raises:
        SettingError: The name does not end in ``.mcap``.
        McapWriteError: The file or its ``.partial`` folder exists, or it cannot be written.
    """

    def __init__(self, path: Path) -> None:
        if path.suffix != SUFFIX or path.stem in ("", ".", ".."):
            raise SettingError("file", str(path), f"the name of a file that ends in {SUFFIX}")
        self.path = path
        self._partial = partial_folder(path)
        for existing in (path, self._partial):
            if existing.exists():
                raise McapWriteError(existing, "exists already: move it away or remove it")
        # rosbags writes folders, and names the file inside a folder after the folder.
        self._writer = _Writer(self._partial / path.stem, version=_VERSION,
                               storage_plugin=StoragePlugin.MCAP)
        self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        try:
            self._writer.open()
        except (OSError, WriterError) as error:
            raise self._error(error) from error

    def add_topic(self, topic: str, kind: str, definitions: Typestore,
                  offers: Sequence[Qos]) -> Connection:
        """Adds a topic.

        Args:
            topic: Name of the topic.
            kind: Type of its messages, ``package/msg/Name``.
            definitions: Definitions of messages, among them that of `kind`.
            offers: Quality of service of each publisher of the topic.

        Returns:
            The topic, as the method `write` needs it.
        """
        return self._writer.add_connection(topic, kind, typestore=definitions,
                                           offered_qos_profiles=offers)

    def write(self, topic: Connection, stamp: int, data: bytes) -> None:
        """Writes a message.

        Args:
            topic: Topic that `add_topic` returned.
            stamp: Time at which the message was received [ns].
            data: The message in CDR, with the header of four bytes.

        Raises:
            McapWriteError: The file cannot be written, for instance because the disk is full.
        """
        try:
            self._writer.write(topic, stamp, data)
        except OSError as error:
            raise self._error(error) from error

    def close(self) -> int:
        """Completes the file and puts it under its name.

        If the disk is full, the newest messages make room for the index at the end of the file.

        Returns:
            Number of messages that did not fit.

        Raises:
            McapWriteError: Not even an empty file can be written.
        """
        storage: Any = self._writer.storage
        lost = 0
        while not storage.complete:
            try:
                storage.finish_chunk()
                self._adopt_counts(storage)
                self._writer.close()
            except OSError as error:
                if storage.complete:
                    break  # only rosbags' metadata.yaml is missing, which is not kept
                dropped = storage.drop_chunk()
                if dropped is None:
                    raise self._error(error) from error
                lost += dropped
        try:
            storage.path.replace(self.path)
            shutil.rmtree(self._partial)
        except OSError as error:
            raise self._error(error) from error
        return lost

    def _adopt_counts(self, storage: "_Storage") -> None:
        """Gives rosbags' writer, whose metadata ends the file, the counts of what is written."""
        self._writer.counts = dict(storage.channel_stats)
        self._writer.min_timestamp = storage.message_start_time
        self._writer.max_timestamp = storage.message_end_time

    def _error(self, error: Exception) -> McapWriteError:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        return McapWriteError(self.path, f"cannot be written: {reason}")


def partial_folder(path: Path) -> Path:
    """Returns the folder in which a recording grows until it is complete."""
    return path.with_name(f"{path.name}.partial")


class _Output(FileIO):
    """A file that writes at once, without a buffer: an error leaves no data for later."""

    def write(self, data: Any) -> int:
        """Writes all of the data; the system writes less where the disk becomes full."""
        left = memoryview(data).cast("B")
        size = len(left)
        while left:
            left = left[super().write(left) or 0:]
        return size


@dataclass(frozen=True)
class _Chunk:
    """What the file's index says of a chunk in it.

    Attributes:
        start: Smallest stamp of its messages [ns].
        end: Largest stamp of its messages [ns].
        counts: Number of its messages by channel.
        file_end: Place in the file at which it ends [bytes].
    """

    start: int
    end: int
    counts: Mapping[int, int]
    file_end: int


class _Storage(McapWriter):
    """The MCAP writer of rosbags, which here can also end a file on a full disk.

    It adds two things that rosbag2 writes and rosbags leaves out, the type's hash of each topic
    and the times of what has no messages.

    Attributes:
        complete: Whether the file has its index and its end.
    """

    def __init__(self, path: Path, compression: CompressionMode) -> None:
        super().__init__(path, compression)
        self.complete = False
        self._data_start = self.bio.tell()
        self._chunks: list[_Chunk] = []
        self.bio.close()
        self.bio: Any = _Output(self.path, "r+b")

    def finish_chunk(self) -> None:
        """Writes the pending chunk, if there is anything in it."""
        if self.chunk.bio.tell():
            self.close_chunk()

    def drop_chunk(self) -> int | None:
        """Removes the pending chunk, or else the last one of the file.

        Returns:
            Number of its messages; None if there is no chunk.
        """
        pending = bool(self.chunk.bio.tell())
        if not pending and not self._chunks:
            return None
        if pending:
            counts = {channel: len(found) for channel, found in self.chunk.msgs.items()}
            self.chunk = PendingChunk(2**63 - 1, 0, BytesIO(), defaultdict(list))
        else:
            self.chunks.pop()
            counts = dict(self._chunks.pop().counts)
        for channel, number in counts.items():
            self.channel_stats[channel] -= number
        filled = [chunk for chunk in self._chunks if chunk.counts]
        self.message_start_time = min((chunk.start for chunk in filled), default=2**63 - 1)
        self.message_end_time = max((chunk.end for chunk in filled), default=0)
        return sum(counts.values())

    def _rewind(self) -> None:
        """Goes to the end of the last whole chunk, and removes the rest of a failed attempt."""
        self.bio.seek(self._chunks[-1].file_end if self._chunks else self._data_start)
        self.bio.truncate()

    def add_connection(self, connection: Connection, offered_qos_profiles: str) -> None:
        """Adds a channel with the hash of its type, which rosbag2 reads next to the offers."""
        metadata = BytesIO()
        for key, value in (("offered_qos_profiles", offered_qos_profiles),
                           ("topic_type_hash", connection.digest)):
            write_string(metadata, key)
            write_string(metadata, value)
        channel = Channel(connection.id, connection.msgtype, connection.topic, "cdr",
                          metadata.getvalue())
        self.channels.append(channel)
        self.channel_stats[connection.id] = 0
        write_channel(self.chunk.bio, channel, self.schemas)

    def close_chunk(self) -> None:
        """Writes a chunk; the times of a chunk without messages are 0, as MCAP requires."""
        chunk = self.chunk
        if not chunk.msgs:
            chunk.message_start_time = 0
        self._rewind()
        super().close_chunk()
        counts = {channel: len(found) for channel, found in chunk.msgs.items()}
        self._chunks.append(_Chunk(
            chunk.message_start_time, chunk.message_end_time, counts, self.bio.tell()))

    def close(self, version: int, metadata: str) -> None:
        """Ends the file; the times of a recording without messages are 0, as MCAP requires."""
        if not any(self.channel_stats.values()):
            self.message_start_time = 0
        self._rewind()
        super().close(version, metadata)
        self.complete = True


class _Writer(Writer):
    STORAGE_PLUGINS: Mapping[StoragePlugin, Any] = {StoragePlugin.MCAP: _Storage}
