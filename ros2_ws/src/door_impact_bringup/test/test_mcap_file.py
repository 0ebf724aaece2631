"""An MCAP file: its contents, when it appears under its name, and which paths are refused."""

import errno
import random
from collections.abc import Callable
from io import FileIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from door_impact_bringup import mcap_file
from door_impact_bringup.errors import McapWriteError
from door_impact_bringup.mcap_file import McapFile, partial_folder
from door_impact_common.errors import SettingError
from hypothesis import given
from hypothesis import strategies as st
from rosbags.highlevel import AnyReader
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2.storage_mcap import McapReader
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_JAZZY)
STRING = "std_msgs/msg/String"
STRING_HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
FOREVER = QosTime(9223372036, 854775807)
LATCHED = Qos(QosHistory.KEEP_LAST, 1, QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL,
              FOREVER, FOREVER, QosLiveliness.AUTOMATIC, FOREVER, False)


def cdr(text: str) -> bytes:
    """Returns a String message in CDR."""
    return bytes(STORE.serialize_cdr(STORE.types[STRING](data=text), STRING))


def written(path: Path, texts: dict[int, str]) -> Path:
    """Writes a file with texts, by the times at which they were received [ns]."""
    file = McapFile(path)
    topic = file.add_topic("/text", STRING, STORE, [LATCHED])
    for stamp, text in texts.items():
        file.write(topic, stamp, cdr(text))
    file.close()
    return path


def test_messages_come_back_with_their_times(tmp_path: Path) -> None:
    """Topic, stamps in nanoseconds and contents are those that were written."""
    path = written(tmp_path / "run.mcap", {5: "five", 1_000_000_007: "later"})
    with AnyReader([path], default_typestore=STORE) as reader:
        read = [(c.topic, t, reader.deserialize(data, c.msgtype).data)
                 for c, t, data in reader.messages()]
    assert read == [("/text", 5, "five"), ("/text", 1_000_000_007, "later")]


def test_the_file_carries_definition_hash_and_quality_of_service(tmp_path: Path) -> None:
    """A reader without ROS 2 can decode it, and `ros2 bag play` can offer the same quality."""
    path = written(tmp_path / "run.mcap", {1: "one"})
    reader = McapReader(path)
    reader.open()
    (topic,) = reader.connections
    assert topic.msgdef.data == "string data\n"
    assert topic.ext.offered_qos_profiles == [LATCHED]
    (channel,) = reader.channels.values()
    assert b"topic_type_hash" in channel.metadata
    assert STRING_HASH.encode() in channel.metadata
    reader.close()


def test_one_file_is_left_and_only_when_it_is_complete(tmp_path: Path) -> None:
    """Until `close` there is only the .partial folder; afterwards there is only the file."""
    path = tmp_path / "deep" / "run.mcap"
    file = McapFile(path)
    assert not path.exists()
    assert partial_folder(path).is_dir()
    file.close()
    assert [found.name for found in path.parent.iterdir()] == ["run.mcap"]


def test_an_existing_recording_is_not_overwritten(tmp_path: Path) -> None:
    """The folder of a killed recorder stays; the error names it."""
    existing = "run.mcap.partial"
    (tmp_path / existing).write_text("precious")
    with pytest.raises(McapWriteError, match=f"{existing}: exists already"):
        McapFile(tmp_path / "run.mcap")
    assert (tmp_path / existing).read_text() == "precious"


def test_only_mcap_files_are_written(tmp_path: Path) -> None:
    """A name with another ending is refused."""
    with pytest.raises(SettingError, match=r"\.mcap") as caught:
        McapFile(tmp_path / "run.bag")
    assert caught.value.setting == "file"


@given(st.integers(0, 700_000))
def test_on_a_full_disk_the_file_keeps_what_fits(capacity: int) -> None:
    """Readers find the first messages; the others are counted, and no half message is there."""
    with TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setattr(mcap_file._Output, "write", disk_of(capacity))
        path, sent, failed = Path(folder, "run.mcap"), 0, False
        file = McapFile(path)
        topic = file.add_topic("/text", STRING, STORE, [LATCHED])
        noise = random.Random(capacity)
        while not failed and sent < 120:  # incompressible, two chunks
            try:
                file.write(topic, sent + 1, cdr(f"{sent} {noise.randbytes(10_000).hex()}"))
            except McapWriteError:
                failed = True
            sent += 1
        try:
            lost = file.close()
        except McapWriteError:
            assert capacity < 10_000  # less than what describes a single topic
            assert not path.exists()
            return
        assert failed or lost or capacity > 500_000
        with AnyReader([path], default_typestore=STORE) as reader:
            (connection,) = reader.connections
            stamps = [stamp for _, stamp, _ in reader.messages()]
            assert connection.msgcount == len(stamps)
            assert not stamps or reader.start_time == 1
        assert stamps == list(range(1, sent - lost + 1))


def disk_of(capacity: int) -> Callable[[Any, Any], int]:
    """The method `write` of a file on a disk with so much room [bytes]."""

    def write(file: Any, data: Any) -> int:
        left = memoryview(data).cast("B")
        room = max(0, capacity - file.tell())
        FileIO.write(file, left[:room])
        if len(left) > room:
            raise OSError(errno.ENOSPC, "No space left on device")
        return len(left)

    return write
