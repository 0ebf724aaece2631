"""Conversion between batches of encoder samples and messages EncoderSamples."""

from door_impact_common.stamps import stamp_of
from door_impact_msgs.msg import EncoderSamples

from door_model.recording.batch import SampleBatch
from door_model.recording.batch import to_batch as to_batch  # the way back

DOOR_JOINT = "door_hinge"
"""Name of the door's joint in the messages."""


def to_message(batch: SampleBatch) -> EncoderSamples:
    """Return the message of a batch."""
    message = EncoderSamples()
    message.header.stamp = stamp_of(batch.stamp_ns)
    message.header.frame_id = DOOR_JOINT
    message.period = batch.period
    message.first_index = batch.first_index
    message.counts_per_turn = batch.counts_per_turn
    message.counts = batch.counts.tolist()
    message.gap_before = batch.gap_before
    message.index_counts = batch.index_counts.tolist()
    return message

