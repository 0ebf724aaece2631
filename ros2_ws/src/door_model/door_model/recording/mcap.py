"""Recordings of the door's encoder in MCAP files: of our recorder, or of `ros2 bag record`."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from door_model.errors import RecordingError
from door_model.recording.recording import Recording
from door_model.recording.sample_store import SampleStore

SAMPLES = "/door_encoder/samples"
COUNTS = "/door_encoder/counts"
_TYPE = "door_impact_msgs/msg/EncoderSamples"
_FOREVER = 1e9  # [s]
_WRAP = 2**16  # counts; counters of 16 bits or more agree modulo this
_SHUT = 20  # samples at the start that give the zero of raw counts


@dataclass(frozen=True)
class RecordedBatch:
    """An EncoderSamples message.

    Attributes:
        stamp_ns: Time of the first sample [ns].
        period: Time between two samples [s].
        first_index: Running number of the first sample.
        counts_per_turn: Counts a turn of the hinge.
        counts: (N,).
        gap_before: Samples are missing between the batch before and this one.
        index_counts: Counter at each index pulse (M,); empty in files that know of none.
    """

    stamp_ns: int
    period: float
    first_index: int
    counts_per_turn: int
    counts: NDArray[np.int64]
    gap_before: bool
    index_counts: NDArray[np.int64]


def read_batches(path: str | Path, topics: Sequence[str]) -> tuple[str, list[RecordedBatch]]:
    """Read the batches of the first of some topics that has any.

    Args:
        path: An MCAP file, or a folder that `ros2 bag record` has made.
        topics: Names of topics of EncoderSamples, the preferred one first.

    Returns:
        The topic and its batches, in the order in which they were received.

    Raises:
        RecordingError: The file cannot be read, or has no message on these topics.
    """
    source = Path(path)
    try:
        if not source.exists():
            raise RecordingError(str(path), None, "cannot be read: no such file")
        with AnyReader([source], default_typestore=get_typestore(Stores.EMPTY)) as reader:
            heard = {connection.topic for connection in reader.connections if connection.msgcount}
            topic = next((name for name in topics if name in heard), None)
            if topic is not None:
                connections = [c for c in reader.connections if c.topic == topic]
                kinds = {connection.msgtype for connection in connections}
                if kinds != {_TYPE}:
                    raise RecordingError(
                        str(path), None, f"{topic} has {', '.join(sorted(kinds))}, not {_TYPE}",
                        value=kinds, limit=_TYPE,
                    )  # fmt: skip
                return topic, [
                    _batch(reader.deserialize(data, connection.msgtype))
                    for connection, _, data in reader.messages(connections)
                ]
    except RecordingError:
        raise
    except OSError as error:
        reason = error.strerror or str(error)
        raise RecordingError(str(path), None, f"cannot be read: {reason}") from error
    except Exception as error:  # whatever rosbags meets in a file that is cut off or damaged
        raise RecordingError(
            str(path), None, f"is no complete MCAP file of ROS 2 ({error or type(error).__name__})"
        ) from error
    there = ", ".join(sorted(heard)) or "none"
    raise RecordingError(
        str(path), None, f"has no messages on {' or '.join(topics)}; topics with messages: {there}",
        value=there, limit=topics,
    )  # fmt: skip


def read_mcap(path: str | Path) -> Recording:
    """Read a recording from `/door_encoder/samples`, or else from `/door_encoder/counts`.

    Samples are checked, unwrapped and zeroed. Raw counts are taken as they are, but for what
    follows from the door: it is shut at the start, which gives the zero, and opens from there,
    which gives the direction; the counter wraps at 2^16 counts or a multiple. Late and duplicated
    batches are dropped; gaps show in the times; where time goes back (a simulation that was
    reset) the recording begins anew.

    Args:
        path: An MCAP file, or a folder that `ros2 bag record` has made.

    Returns:
        The recording, times from its first sample on.

    Raises:
        RecordingError: The file cannot be read, or has no such topic.
        DoorParameterError: A batch has no positive period or counts_per_turn.
    """
    topic, batches = read_batches(path, (SAMPLES, COUNTS))
    store = SampleStore(_FOREVER)
    for batch in batches:
        store.add(batch.stamp_ns, batch.period, batch.counts_per_turn, batch.counts)
    recording = store.recording()
    if topic == SAMPLES or not recording.t.size:
        return recording
    theta = np.unwrap(recording.theta, period=_WRAP * recording.resolution)
    theta -= np.median(theta[:_SHUT])
    if -theta.min() > theta.max():
        theta = -theta
    return Recording(recording.t, theta, recording.resolution)


def _batch(message: Any) -> RecordedBatch:
    """A message as rosbags has it."""
    stamp = message.header.stamp
    return RecordedBatch(
        stamp_ns=stamp.sec * 1_000_000_000 + stamp.nanosec,
        period=message.period,
        first_index=message.first_index,
        counts_per_turn=message.counts_per_turn,
        counts=message.counts,
        gap_before=message.gap_before,
        index_counts=getattr(message, "index_counts", np.empty(0, dtype=np.int64)),
    )
