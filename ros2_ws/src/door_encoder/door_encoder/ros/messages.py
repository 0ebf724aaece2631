"""Between batches and messages."""

from door_impact_msgs.msg import EncoderSamples
from rclpy.time import Time

from door_encoder.decoding.batch import Batch

JOINT = "door_hinge"


def to_message(batch: Batch) -> EncoderSamples:
    """Message of a batch."""
    message = EncoderSamples()
    message.header.stamp = Time(nanoseconds=batch.stamp_ns).to_msg()
    message.header.frame_id = JOINT
    message.period = batch.period
    message.first_index = batch.first_index
    message.counts_per_turn = batch.counts_per_turn
    message.counts = [int(value) for value in batch.values]
    message.gap_before = batch.gap_before
    message.index_counts = [int(value) for value in batch.index_values]
    return message


def to_batch(message: EncoderSamples) -> Batch:
    """Batch of a message."""
    return Batch(
        stamp_ns=Time.from_msg(message.header.stamp).nanoseconds,
        period=message.period,
        first_index=message.first_index,
        counts_per_turn=message.counts_per_turn,
        values=message.counts,
        gap_before=message.gap_before,
        index_values=message.index_counts,
    )
