"""Reads recordings of the door's encoder from MCAP files, also those of `ros2 bag record`."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from door_impact_common.errors import InputError
from door_impact_common.files import LARGEST_FILE, is_folder, read_file, shown
from door_impact_common.yaml_files import read_yaml
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

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


def read_batches(
    path: str | Path, topics: Sequence[str], folders: Sequence[Path] | None = None
) -> tuple[str, list[SampleBatch]]:
    """Read the batches of the first of several topics that has any.

    Args:
        path: An MCAP file, or a folder that `ros2 bag record` has made.
        topics: Names of topics of type EncoderSamples, the preferred one first.
        folders: As for `door_model.recording.recording.read_csv`.

    Returns:
        The topic and its batches, in the order in which they were received.

    Raises:
        BadRecordingError: The file cannot be read, or has no message on these topics.
    """
    source = shown(path)
    with open_bag(path, folders) as reader:
        there = {connection.topic for connection in reader.connections if connection.msgcount}
        topic = next((name for name in topics if name in there), None)
        if topic is not None:
            connections = [c for c in reader.connections if c.topic == topic]
            kinds = {connection.msgtype for connection in connections}
            if kinds != {_TYPE}:
                raise BadRecordingError(
                    source, None, f"{topic} has {', '.join(sorted(kinds))}, not {_TYPE}",
                    value=kinds, limit=_TYPE)
            return topic, [
                _batch(reader.deserialize(data, connection.msgtype))
                for connection, _, data in reader.messages(connections)
            ]
    listed = ", ".join(sorted(there)) or "none"
    raise BadRecordingError(
        source, None,
        f"has no messages on {' or '.join(topics)}; topics with messages: {listed}",
        value=listed, limit=topics)


@contextmanager
def open_bag(path: str | Path, folders: Sequence[Path] | None = None) -> Iterator[AnyReader]:
    """Open a recording for reading.

    Args:
        path: An MCAP file, or a folder that `ros2 bag record` has made.
        folders: As for `door_model.recording.recording.read_csv`.

    Raises:
        BadRecordingError: The file cannot be read, or what is read within the context is damaged.
    """
    source = shown(path)
    try:
        with _copied(path, folders) as copy, AnyReader(
                [copy], default_typestore=get_typestore(Stores.EMPTY)) as reader:
            yield reader
    except BadRecordingError:
        raise
    except InputError as error:
        raise BadRecordingError(
            source, None, error.problem, value=source, limit="a readable file") from error
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise BadRecordingError(source, None, f"cannot be read: {reason}",
                                value=source, limit="a readable file") from error
    except Exception as error:  # rosbags raises many kinds where a file is cut off or damaged
        raise BadRecordingError(
            source, None, f"is no complete MCAP file of ROS 2 ({type(error).__name__})",
            value=source, limit="a complete MCAP file") from error


@contextmanager
def _copied(path: str | Path, folders: Sequence[Path] | None) -> Iterator[Path]:
    """Give rosbags a copy of a recording, because it opens files by their names itself.

    Raises:
        InputError: A file cannot be read, or all files together are too large.
    """
    with TemporaryDirectory() as place:
        copy = Path(place, "bag")
        if not is_folder(path, folders):
            copy = Path(place, PurePath(path).name)
            copy.write_bytes(read_file(path, folders))
            yield copy
            return
        copy.mkdir()
        listed = read_yaml(Path(path, "metadata.yaml"), folders)
        names = ["metadata.yaml", *listed["rosbag2_bagfile_information"]["relative_file_paths"]]
        left = LARGEST_FILE
        for name in names:
            file = PurePath(name).name
            content = read_file(Path(path, file), folders, largest=left)
            left -= len(content)
            Path(copy, file).write_bytes(content)
        yield copy


def read_mcap(path: str | Path, folders: Sequence[Path] | None = None) -> Recording:
    """Read a recording from `/door_encoder/samples`, or else from `/door_encoder/counts`.

    Samples are already checked, unwrapped and zeroed. Raw counts are unwrapped only, without a
    check. Their zero and direction follow from the door, which must be shut at the start of the
    recording and open from there; the counter must wrap at 2^16 counts or a multiple of them, or
    never. Late and duplicated batches are dropped. Gaps show in the sample times. If the time goes
    back, because a simulation was reset, the recording begins anew.

    Args:
        path: An MCAP file, or a folder that `ros2 bag record` has made.
        folders: As for `door_model.recording.recording.read_csv`.

    Returns:
        The recording; its times begin at 0.

    Raises:
        BadRecordingError: The file cannot be read, or has no such topic.
        DoorParameterError: A batch has no positive period or counts_per_turn.
    """
    topic, batches = read_batches(path, (SAMPLES, COUNTS), folders)
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
