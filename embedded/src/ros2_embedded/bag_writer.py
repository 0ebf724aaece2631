"""Bags as rosbag2 writes them: a folder with one MCAP file and `metadata.yaml`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.rosbag2.storage_mcap import Channel, McapWriter, write_channel, write_string

from ros2_embedded.catalogue import interface_text, message_spec
from ros2_embedded.typehash import type_hash

_NANOSECONDS = 1_000_000_000
_INFINITE = 2**63 - 1
_OWN_DISTRO, _DISTRO = "ros_distro: rosbags", "ros_distro: jazzy"
_SEPARATOR = "=" * 80


class _Storage(McapWriter):
    """The MCAP storage of rosbags, with the file name and the metadata of rosbag2.

    door_impact_bringup has some of this in mcap_file.py: it runs on ROS 2 too, where this
    package is not.
    """

    def __init__(self, path: Path, compression: CompressionMode) -> None:
        """Opens `FOLDER/FOLDER_0.mcap`."""
        super().__init__(path, compression)
        self.path = self.path.rename(path / f"{path.name}_0.mcap")

    def add_connection(self, connection: Connection, offered_qos_profiles: str) -> None:
        """Adds a channel. rosbag2 expects the hash of the type in the channel's metadata."""
        metadata = BytesIO()
        offers = ("offered_qos_profiles", offered_qos_profiles)
        for text in (*offers, "topic_type_hash", connection.digest):
            write_string(metadata, text)
        channel = Channel(
            connection.id, connection.msgtype, connection.topic, "cdr", metadata.getvalue()
        )
        self.channels.append(channel)
        self.channel_stats[connection.id] = 0
        write_channel(self.chunk.bio, channel, self.schemas)

    def close_chunk(self) -> None:
        """Writes a chunk. The times of a chunk without messages are zero, as MCAP demands."""
        if not self.chunk.msgs:
            self.chunk.message_start_time = 0
        super().close_chunk()

    def close(self, version: int, metadata: str) -> None:
        """Completes the file. The times of a file without messages are zero as well."""
        if not any(self.channel_stats.values()):
            self.message_start_time = 0
        super().close(version, metadata.replace(_OWN_DISTRO, _DISTRO))


class _Writer(Writer):
    STORAGE_PLUGINS: Mapping[StoragePlugin, Any] = {StoragePlugin.MCAP: _Storage}


class BagWriter:
    """Writes a bag; memory stays bounded, since chunks of about 1 MiB are written as they fill."""

    def __init__(self, folder: Path, *, compress: bool, custom_data: Mapping[str, str]) -> None:
        """Makes the folder.

        Raises:
            OSError: it cannot be made.
            WriterError: it exists.
        """
        self._writer = _Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP)
        if compress:
            self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        for key, value in custom_data.items():
            self._writer.set_custom_data(key, value)
        self._writer.open()

    def add_topic(self, topic: str, kind: str, offers: Sequence[Any]) -> Connection:
        """Adds a topic.

        Args:
            topic: Full name of the topic.
            kind: Type of its messages, `pkg/msg/Name`.
            offers: Quality of service of its publishers, as rclpy's profiles.

        Returns:
            The connection that `write` needs.
        """
        return self._writer.add_connection(
            topic,
            kind,
            msgdef=full_definition(kind),
            rihs01=type_hash(kind),
            offered_qos_profiles=[_recorded(offer) for offer in offers],
        )

    def write(self, topic: Connection, stamp: int, data: bytes) -> None:
        """Writes a message: `stamp` is when it was received [ns], `data` its CDR with header."""
        self._writer.write(topic, stamp, data)

    def close(self) -> None:
        """Completes the bag."""
        if not self._writer.max_timestamp:  # rosbags would write the year 2262
            self._writer.min_timestamp = 0
        self._writer.close()
        path = self._writer.metapath
        text = path.read_text("utf-8")
        path.write_text(text.replace(_OWN_DISTRO, _DISTRO), "utf-8")


def full_definition(name: str) -> str:
    """The definitions of a message and of all messages that it refers to, as a bag stores them."""
    order = [name]
    for current in order:  # the list grows while it is read
        for field in message_spec(current).fields:
            if not field.type.primitive and field.type.base not in order:
                order.append(field.type.base)
    texts = [interface_text(each) for each in order]
    parts = zip(order[1:], texts[1:], strict=True)
    return texts[0] + "".join(f"{_SEPARATOR}\nMSG: {part}\n{text}" for part, text in parts)


def _recorded(offer: Any) -> Qos:
    """Converts a profile of rclpy into one of rosbags."""
    return Qos(
        QosHistory[offer.history.name],
        offer.depth,
        QosReliability[offer.reliability.name],
        QosDurability[offer.durability.name],
        _time(offer, "deadline"),
        _time(offer, "lifespan"),
        QosLiveliness[offer.liveliness.name],
        _time(offer, "liveliness_lease_duration"),
        avoid_ros_namespace_conventions=False,
    )


def _time(offer: Any, name: str) -> QosTime:
    duration = getattr(offer, name, None)
    nanoseconds = _INFINITE if duration is None else duration.nanoseconds
    return QosTime(*divmod(min(nanoseconds, _INFINITE), _NANOSECONDS))
