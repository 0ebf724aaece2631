"""One recording in one file: MCAP as rosbag2 writes and reads it."""

import shutil
from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

from door_impact_common.errors import SettingError
from rosbags.interfaces import Connection, Qos
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer, WriterError
from rosbags.rosbag2.storage_mcap import Channel, McapWriter, write_channel, write_string
from rosbags.typesys.store import Typestore

from door_impact_bringup.errors import RecordingError

SUFFIX = ".mcap"


class McapFile:
    """Writes messages to a file, which stands under its name when it is complete.

    Until then it grows in a folder beside it, ``NAME.mcap.partial``: a recorder that was killed
    leaves it there. Memory stays bounded: chunks of about 1 MiB are compressed and written.

    Args:
        path: The file, ``NAME.mcap``; folders above it are made.

    Raises:
        SettingError: The name ends otherwise.
        RecordingError: It or its unfinished folder exists, or it cannot be written.
    """

    def __init__(self, path: Path) -> None:
        if path.suffix != SUFFIX or path.stem in ("", ".", ".."):
            raise SettingError("file", str(path), f"the name of a file that ends in {SUFFIX}")
        self.path = path
        self._partial = partial_folder(path)
        for there in (path, self._partial):
            if there.exists():
                raise RecordingError(there, "exists already: move it away or remove it")
        # rosbags writes folders and calls the file inside after its folder.
        self._writer = _Writer(self._partial / path.stem, version=9,
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
            topic: Name.
            kind: ``package/msg/Name``.
            definitions: Knows it.
            offers: Quality of service of its publishers.

        Returns:
            What `write` takes.
        """
        return self._writer.add_connection(topic, kind, typestore=definitions,
                                           offered_qos_profiles=offers)

    def write(self, topic: Connection, stamp: int, data: bytes) -> None:
        """Writes a message.

        Args:
            topic: As `add_topic` returned it.
            stamp: When it was received [ns].
            data: CDR with its header of four bytes.

        Raises:
            RecordingError: The disk is full, for instance.
        """
        try:
            self._writer.write(topic, stamp, data)
        except OSError as error:
            raise self._error(error) from error

    def close(self) -> None:
        """Completes the file and puts it in its place.

        Raises:
            RecordingError: It could not be written.
        """
        try:
            self._writer.close()
            (self._partial / self.path.stem / self.path.name).replace(self.path)
            shutil.rmtree(self._partial)
        except OSError as error:
            raise self._error(error) from error

    def _error(self, error: Exception) -> RecordingError:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        return RecordingError(self.path, f"cannot be written: {reason}")


def partial_folder(path: Path) -> Path:
    """Where a recording grows before it stands under its name."""
    return path.with_name(f"{path.name}.partial")


class _Storage(McapWriter):
    """rosbags' MCAP, with what rosbag2 writes beyond it."""

    def add_connection(self, connection: Connection, offered_qos_profiles: str) -> None:
        """Adds a channel; rosbag2 looks for the type's hash beside the offers."""
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
        """Writes a chunk; where it has no message its times are zero, as MCAP says."""
        if not self.chunk.msgs:
            self.chunk.message_start_time = 0
        super().close_chunk()

    def close(self, version: int, metadata: str) -> None:
        """Ends the file, in the same way where it has no message at all."""
        if not any(self.channel_stats.values()):
            self.message_start_time = 0
        super().close(version, metadata)


class _Writer(Writer):
    STORAGE_PLUGINS: Mapping[StoragePlugin, Any] = {StoragePlugin.MCAP: _Storage}
