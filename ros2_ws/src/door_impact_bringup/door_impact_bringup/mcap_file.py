"""Writes a recording as one MCAP file, in the form in which rosbag2 writes and reads it.

The format is written by the library rosbags; this module adds what the recorder needs beyond it: a
single file that stands under its name only when it is complete, the hash of each message type,
and valid times in a recording without messages.

`ros2 bag record` cannot take its place: on ROS 2 and on the embedded runtime alike it writes a
folder, and when it is killed an incomplete file stands under the final name. The embedded runtime's
`ros2 bag record` extends the same writer of rosbags in ros2_embedded/bag_writer.py. The two cannot
share a module: the recorder must run on ROS 2, where ros2_embedded is not installed, and the
runtime is a distribution of its own that imports nothing of this project.
"""

import shutil
from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any, Final

from door_impact_common.errors import SettingError
from rosbags.interfaces import Connection, Qos
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer, WriterError
from rosbags.rosbag2.storage_mcap import Channel, McapWriter, write_channel, write_string
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

    def close(self) -> None:
        """Completes the file and puts it under its name.

        Raises:
            McapWriteError: The file cannot be written.
        """
        try:
            self._writer.close()
            (self._partial / self.path.stem / self.path.name).replace(self.path)
            shutil.rmtree(self._partial)
        except OSError as error:
            raise self._error(error) from error

    def _error(self, error: Exception) -> McapWriteError:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        return McapWriteError(self.path, f"cannot be written: {reason}")


def partial_folder(path: Path) -> Path:
    """Returns the folder in which a recording grows until it is complete."""
    return path.with_name(f"{path.name}.partial")


class _Storage(McapWriter):
    """The MCAP writer of rosbags, with two things that rosbag2 writes and rosbags leaves out."""

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
        if not self.chunk.msgs:
            self.chunk.message_start_time = 0
        super().close_chunk()

    def close(self, version: int, metadata: str) -> None:
        """Ends the file; the times of a recording without messages are 0, as MCAP requires."""
        if not any(self.channel_stats.values()):
            self.message_start_time = 0
        super().close(version, metadata)


class _Writer(Writer):
    STORAGE_PLUGINS: Mapping[StoragePlugin, Any] = {StoragePlugin.MCAP: _Storage}
