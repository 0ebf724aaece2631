"""Command `ros2 run door_encoder play`: publishes a recording on /door_encoder/counts."""

import argparse
import math
import sys
import time
from collections.abc import Sequence
from dataclasses import replace

import rclpy
from door_impact_common.node import executor_of, run_node, spin_for
from door_impact_msgs.msg import EncoderSamples
from door_model.errors import DoorModelError
from door_model.recording.batch import SampleBatch
from door_model.recording.recording import COUNTS_PER_TURN
from door_model.ros.messages import to_message
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.utilities import remove_ros_args

from door_encoder.errors import DoorEncoderError
from door_encoder.playback import batches_from_csv, batches_from_mcap

_QUEUE = 200  # number of batches that the publisher keeps
_PATIENCE = 5.0  # longest wait for a subscriber, and for it to receive the last batch [s]

_DESCRIPTION = """\
Publish a recording of the door on /door_encoder/counts in batches, as a counter board would, so
that door_encoder and the nodes after it run on recorded data. The stamps are those of the
recording, shifted so that they begin now."""


class PlayNode(Node):
    """Publishes batches in time and ends."""

    def __init__(self, batches: Sequence[SampleBatch], rate: float) -> None:
        super().__init__("door_encoder_player")
        self._batches = batches
        self._rate = rate
        self._counts = self.create_publisher(
            EncoderSamples, "/door_encoder/counts", QoSProfile(depth=_QUEUE)
        )

    def run(self) -> None:
        """Publish all batches, each at the time at which its last sample was measured."""
        self._callbacks = executor_of(self)
        self._spin_until(time.monotonic() + _PATIENCE, subscribed=True)
        if not self._counts.get_subscription_count():
            self.get_logger().warning("no node subscribes to /door_encoder/counts: playing anyway")
        origin_ns = self._batches[0].stamp_ns
        shift_ns = self.get_clock().now().nanoseconds - origin_ns
        begin = time.monotonic()
        for batch in self._batches:
            end = (batch.stamp_ns - origin_ns) * 1e-9 + len(batch.counts) * batch.period
            self._spin_until(begin + end / self._rate)
            if not rclpy.ok():
                return
            stamp_ns = batch.stamp_ns + shift_ns
            self._counts.publish(to_message(replace(batch, stamp_ns=stamp_ns)))
        self._counts.wait_for_all_acked(Duration(seconds=_PATIENCE))
        samples = sum(len(batch.counts) for batch in self._batches)
        self.get_logger().info(f"played {samples} samples in {len(self._batches)} batches")

    def _spin_until(self, end: float, *, subscribed: bool = False) -> None:
        """Spin until a time on the steady clock [s], or optionally until there is a subscriber."""
        while rclpy.ok() and not (subscribed and self._counts.get_subscription_count()):
            left = end - time.monotonic()
            if left <= 0.0:
                return
            spin_for(self._callbacks, min(left, 0.1))


def _rate(text: str) -> float:
    """Parse a positive number.

    Raises:
        ArgumentTypeError: The text is none.
    """
    try:
        rate = float(text)
    except ValueError:
        rate = math.nan
    if not (math.isfinite(rate) and rate > 0.0):
        raise argparse.ArgumentTypeError(f"must be a positive number, not {text!r}")
    return rate


def main(args: list[str] | None = None) -> int:
    """Run the command; the exit code is 1 if the recording cannot be played."""
    args = sys.argv if args is None else ["play", *args]
    parser = argparse.ArgumentParser(prog="play", description=_DESCRIPTION)
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument(
        "--csv", metavar="FILE", help="recording with time_s,count or time_s,angle_deg as header"
    )
    source.add_argument(
        "--mcap",
        metavar="FILE",
        help="recording with /door_encoder/counts, or else /door_encoder/samples",
    )
    parser.add_argument(
        "--rate",
        type=_rate,
        default=1.0,
        metavar="R",
        help="speed relative to the recording; stamps then deviate from the clock "
        "(default %(default)s)",
    )
    parser.add_argument(
        "--counts-per-turn",
        type=int,
        default=COUNTS_PER_TURN,
        metavar="N",
        help="counts in a turn of the hinge, for a CSV with counts (default %(default)s)",
    )
    options = parser.parse_args(remove_ros_args(args)[1:])
    try:
        if options.mcap:
            batches = batches_from_mcap(options.mcap)
        else:
            batches = batches_from_csv(options.csv, options.counts_per_turn)
    except (DoorModelError, DoorEncoderError) as error:
        print(f"play: {error}", file=sys.stderr)
        return 1

    def play() -> PlayNode:
        return PlayNode(batches, options.rate)

    return run_node(play, args=args, spin=PlayNode.run)


if __name__ == "__main__":
    sys.exit(main())
