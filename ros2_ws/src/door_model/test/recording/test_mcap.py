"""Recordings in MCAP files: samples, raw counts, missing topics, damaged files."""

from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zstandard
from ament_index_python.packages import get_package_share_directory
from door_model.data import data_path
from door_model.errors import BadRecordingError, DoorModelError
from door_model.recording.mcap import COUNTS, SAMPLES, read_batches, read_mcap, read_recording
from door_model.recording.recording import COUNTS_PER_TURN, read_csv
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import Writer as McapWriter
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

KIND = "door_impact_msgs/msg/EncoderSamples"
STORE = get_typestore(Stores.ROS2_JAZZY)
_FILE = Path(get_package_share_directory("door_impact_msgs")) / "msg" / "EncoderSamples.msg"
STORE.register(get_types_from_msg(_FILE.read_text(), KIND))
SWINGS = read_csv(data_path("recordings") / "paper_five_swings.csv")
SWING_COUNTS = np.rint(SWINGS.theta / SWINGS.resolution).astype(np.int64)


def batch(first: int, counts: Any, **changes: Any) -> Any:
    """Return a message at 1 kHz whose stamp follows from its number."""
    header, time = STORE.types["std_msgs/msg/Header"], STORE.types["builtin_interfaces/msg/Time"]
    nanoseconds = 5 * 10**9 + first * 10**6
    stamp = time(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)
    fields = {
        "header": header(stamp=stamp, frame_id="door_hinge"), "period": 1e-3, "first_index": first,
        "counts_per_turn": COUNTS_PER_TURN, "counts": np.asarray(counts, dtype=np.int64),
        "gap_before": False, "index_counts": np.array([], dtype=np.int64), **changes}  # fmt: skip
    return STORE.types[KIND](**fields)


def batches(counts: Any, size: int = 20) -> list[Any]:
    """Cut a stream into messages."""
    return [batch(first, counts[first : first + size]) for first in range(0, len(counts), size)]


def bag(folder: Path, topics: dict[str, list[Any]]) -> Path:
    """Write a bag like `ros2 bag record -s mcap`: a folder with metadata.yaml and FOLDER.mcap."""
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for topic, messages in topics.items():
            kind = messages[0].__msgtype__ if messages else KIND
            connection = writer.add_connection(topic, kind, typestore=STORE)
            for number, message in enumerate(messages):
                data = STORE.serialize_cdr(message, kind)
                writer.write(connection, 10**9 + number * 20_000_000, data)
    return folder


def test_samples_are_the_csv_again(tmp_path: Path) -> None:
    """The folder and its file give the door of the CSV; samples are preferred to counts."""
    folder = bag(tmp_path / "bag", {COUNTS: batches([5] * 40), SAMPLES: batches(SWING_COUNTS)})
    for path in (folder, folder / "bag.mcap"):
        found = read_mcap(path)
        np.testing.assert_allclose(found.t, SWINGS.t, atol=1e-9)
        np.testing.assert_allclose(found.theta, SWINGS.theta)
        assert found.resolution == SWINGS.resolution


@pytest.mark.parametrize(("sign", "offset", "modulus"), [
    (1, 65530, 2**16), (-1, 40, 2**32), (1, 14300, 14400), (1, 2**45, 2**60)])
def test_raw_counts_are_unwrapped_zeroed_and_turned(
    tmp_path: Path, sign: int, offset: int, modulus: int
) -> None:
    """The door opens from 0 for any zero, direction and width of the counter."""
    raw = (sign * SWING_COUNTS + offset) % modulus
    found = read_mcap(bag(tmp_path / "bag", {COUNTS: batches(raw)}))
    np.testing.assert_allclose(found.theta, SWINGS.theta, atol=1e-9)


def test_gaps_show_in_the_times_and_late_batches_go(tmp_path: Path) -> None:
    """A lost batch is a hole of 20 ms, and a repeated batch is used once."""
    parts = batches(np.arange(100))
    found = read_mcap(bag(tmp_path / "bag", {SAMPLES: [*parts[:2], parts[1], *parts[3:]]}))
    assert len(found.t) == 80
    assert np.diff(found.t).max() == pytest.approx(0.021)


def test_a_missing_topic_is_said_with_those_that_are_there(tmp_path: Path) -> None:
    """The error lists the topics that have messages."""
    time = STORE.types["builtin_interfaces/msg/Time"](sec=1, nanosec=0)
    clock = STORE.types["rosgraph_msgs/msg/Clock"](clock=time)
    path = bag(tmp_path / "bag", {"/clock": [clock], SAMPLES: []})
    with pytest.raises(BadRecordingError, match=r"counts \(--topic .* messages: /clock"):
        read_mcap(path)
    other = bag(tmp_path / "other", {SAMPLES: [clock]})
    with pytest.raises(BadRecordingError, match="has rosgraph_msgs/msg/Clock, not"):
        read_mcap(other)


def test_a_topic_can_be_chosen(tmp_path: Path) -> None:
    """Of two doors --topic takes one, and without it nothing is guessed."""
    topics = {f"/{name}/door_encoder/counts": batches(sign * SWING_COUNTS + 500)
              for name, sign in (("left", -1), ("right", 1))}
    path = bag(tmp_path / "bag", topics)
    for topic in topics:
        np.testing.assert_allclose(read_mcap(path, topic[1:]).theta, SWINGS.theta, atol=1e-9)
    with pytest.raises(BadRecordingError, match=r"--topic .* /left/door_encoder/counts, /right"):
        read_mcap(path)


@pytest.mark.parametrize(("start", "match"), [
    (b"#ROSBAG V2.0\n", r"a bag of ROS 1, .* `rosbags-convert"),
    (b"SQLite format 3\0", "a bag of ROS 2 in SQLite"), (b"", "messages in json, must be cdr"),
    (zstandard.compress(b"SQLite format 3\0"), "a bag of ROS 2 in SQLite")])
def test_other_formats_are_named(tmp_path: Path, start: bytes, match: str) -> None:
    """The error names the format and what to do; JSON has no schema, protobuf one in bytes."""
    path = tmp_path / "run.mcap"
    with path.open("wb") as stream:
        stream.write(start)
        writer = McapWriter(stream)
        writer.start()
        other = writer.register_channel("/x", "", writer.register_schema("x", "", b"\xff"))
        for channel in (writer.register_channel(SAMPLES, "json", 0), other):
            writer.add_message(channel, 1, b"{}", 1)
        writer.finish()
    with pytest.raises(BadRecordingError, match=match):
        read_mcap(path)


def test_batches_keep_what_the_messages_say(tmp_path: Path) -> None:
    """Batches keep numbers, gaps and index pulses for playback."""
    sent = [batch(7, [1, 2], index_counts=np.array([300])), batch(60, [3], gap_before=True)]
    topic, found = read_batches(bag(tmp_path / "bag", {COUNTS: sent}), (COUNTS, SAMPLES))
    assert topic == COUNTS
    assert [b.first_index for b in found] == [7, 60]
    assert [b.gap_before for b in found] == [False, True]
    assert found[0].index_counts.tolist() == [300]
    assert found[1].stamp_ns == 5_060_000_000


@pytest.mark.parametrize("mode", ["message", "file"])
def test_what_rosbag2_compresses_is_read_without_its_metadata(tmp_path: Path, mode: str) -> None:
    """`ros2 bag record --compression-mode`, as a folder and as a file alone."""
    folder = tmp_path / "bag"
    writer = Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP)
    if mode == "message":
        writer.set_compression(CompressionMode.MESSAGE, CompressionFormat.ZSTD)
    with writer:
        connection = writer.add_connection(SAMPLES, KIND, typestore=STORE)
        for message in batches(np.arange(100)):
            writer.write(connection, 10**9, STORE.serialize_cdr(message, KIND))
    file = folder / "bag.mcap"
    if mode == "file":
        packed = folder / "bag.mcap.zstd"
        packed.write_bytes(zstandard.compress(file.read_bytes()))
        file.unlink()
        file = packed
    (folder / "metadata.yaml").unlink()
    for path in (folder, file):
        np.testing.assert_allclose(read_recording(path).theta / SWINGS.resolution, np.arange(100))


def test_a_chunk_that_was_cut_off_is_read_up_to_there(tmp_path: Path) -> None:
    """A file of one chunk that lost its second half gives more than a third of the samples."""
    file = bag(tmp_path / "bag", {SAMPLES: batches(np.arange(2000))}) / "bag.mcap"
    content = file.read_bytes()
    file.write_bytes(content[: len(content) // 2])
    assert 700 < len(read_mcap(file).t) < 1400
    file.write_bytes(content[:200])
    with pytest.raises(BadRecordingError, match="cut off before"):
        read_mcap(file)


@pytest.fixture(scope="module")
def chunked(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, list[int]]:
    """Return the content of a file with ten batches in a chunk each, and where each chunk ends."""
    path, ends = tmp_path_factory.mktemp("chunked") / "run.mcap", list[int]()
    with path.open("wb") as stream:
        writer = McapWriter(stream)
        writer.start("ros2")
        text = STORE.generate_msgdef(KIND, ros_version=2)[0].encode()
        channel = writer.register_channel(
            SAMPLES, "cdr", writer.register_schema(KIND, "ros2msg", text))
        for message in batches(np.arange(200)):
            writer.add_message(channel, 1, bytes(STORE.serialize_cdr(message, KIND)), 1)
            writer.flush()
            ends.append(stream.tell())
        writer.finish()
    return path.read_bytes(), ends


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(share=st.floats(0.0, 1.0))
def test_a_file_that_was_cut_off_is_read_up_to_its_last_chunk(
    chunked: tuple[bytes, list[int]], tmp_path: Path, share: float
) -> None:
    """Wherever a recorder was killed, complete chunks give all of their samples."""
    content, ends = chunked
    size = int(share * len(content))
    path = tmp_path / "cut.mcap"
    path.write_bytes(content[:size])
    complete = sum(end <= size for end in ends)
    if not complete:  # a chunk's index follows its messages
        with suppress(BadRecordingError):
            assert len(read_mcap(path).t) == 20
        return
    assert len(read_mcap(path).t) in (20 * complete, min(200, 20 * complete + 20))


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_file_with_changed_bytes_is_read_or_refused(
    chunked: tuple[bytes, list[int]], tmp_path: Path, data: st.DataObject
) -> None:
    """No other error than the package's own comes out of a damaged file."""
    path = tmp_path / "damaged.mcap"
    damaged = bytearray(chunked[0])
    for _ in range(3):
        damaged[data.draw(st.integers(0, len(damaged) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(damaged)
    with suppress(DoorModelError):
        read_mcap(path)


def test_the_files_of_a_folder_follow_each_other_by_number(tmp_path: Path) -> None:
    """`ros2 bag record --max-bag-size` makes bag_0 to bag_10; metadata.yaml is not needed."""
    folder = tmp_path / "bag"
    folder.mkdir()
    parts = batches(np.arange(220))
    for number, message in enumerate(parts):
        part = bag(tmp_path / str(number), {SAMPLES: [message]})
        (part / f"{number}.mcap").rename(folder / f"bag_{number}.mcap")
    _, found = read_batches(folder, (SAMPLES,))
    assert [each.first_index for each in found] == [part.first_index for part in parts]
