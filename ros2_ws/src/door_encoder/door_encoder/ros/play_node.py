"""Command `ros2 run door_encoder play`: publishes a recording on door_encoder/counts."""

import argparse
import sys
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import rclpy
from door_impact_common.node import executor_of, run_node, spin_for
from door_impact_msgs.msg import EncoderSamples
from door_model.errors import DoorModelError
from door_model.recording.batch import SampleBatch
from door_model.recording.mcap import COUNTS, SAMPLES, read_batches
from door_model.recording.recording import COUNTS_PER_TURN, Recording, read_csv
from door_model.ros.messages import to_message
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.utilities import remove_ros_args

from door_encoder.errors import DoorEncoderError, PlaybackError

BATCH = 0.02  # duration of a batch [s]
_RESOLUTION = 2.0 * np.pi / COUNTS_PER_TURN  # angle of a count where a recording has angles [rad]
_QUEUE = 1000  # 20 s: number of batches that the publisher keeps
_PATIENCE = 5.0  # longest wait for a subscriber, and for it to receive the last batch [s]

_DESCRIPTION = """\
Publish a recording of the door on door_encoder/counts in batches, as a counter board would, so
that door_encoder and the nodes after it run on recorded data. The stamps are those of the
recording, shifted so that they begin now."""


def batches(recording: Recording) -> list[SampleBatch]:
    """Cut a recording into batches of 20 ms whose running numbers follow from the sample times.

    Raises:
        PlaybackError: There are fewer than two samples, or they are not evenly spaced: the time
            between two samples must be a whole number of periods, to half a period.
    """
    t = recording.t
    if len(t) < 2:
        raise PlaybackError(quantity="number of samples", value=len(t), limit="2 or more")
    periods = np.diff(t)
    usual = np.median(periods)
    period = float(periods[np.abs(periods - usual) < 0.5 * usual].mean())  # without the gaps
    steps = np.rint(periods / period).astype(np.int64)
    if not steps.all():
        at = int(np.argmin(steps))
        raise PlaybackError(
            f"the samples are not evenly spaced: {periods[at]:g} s at {t[at]:g} s, elsewhere "
            f"{period:g} s",
            quantity="time between two samples [s]", value=float(periods[at]), limit=period)
    numbers = np.concatenate([[0], np.cumsum(steps)])
    resolution = recording.resolution or _RESOLUTION
    counts = np.rint(recording.theta / resolution).astype(np.int64)
    size = max(1, round(BATCH / period))
    return [
        SampleBatch(
            stamp_ns=round(t[at] * 1e9),
            period=period,
            first_index=int(numbers[at]),
            counts_per_turn=round(2.0 * np.pi / resolution),
            counts=counts[at : min(at + size, part[-1] + 1)],
            gap_before=bool(at > 0 and at == part[0]))
        for part in np.split(np.arange(len(t)), np.flatnonzero(steps > 1) + 1)
        for at in part[::size]]


class PlayNode(Node):
    """Publishes batches in time and ends."""

    def __init__(self, played: Sequence[SampleBatch], rate: float) -> None:
        super().__init__("door_encoder_player")
        self._played, self._rate = played, rate
        self._counts = self.create_publisher(
            EncoderSamples, "door_encoder/counts", QoSProfile(depth=_QUEUE))

    def run(self) -> None:
        """Publish all batches, each at the time at which its last sample was measured."""
        self._callbacks = executor_of(self)
        self._spin_until(time.monotonic() + _PATIENCE, subscribed=True)
        if not self._counts.get_subscription_count():
            self.get_logger().warning(
                f"no node subscribes to {self._counts.topic_name}: playing anyway")
        origin_ns = self._played[0].stamp_ns
        shift_ns = self.get_clock().now().nanoseconds - origin_ns
        begin = time.monotonic()
        for batch in self._played:
            self._spin_until(begin + 1e-9 * (batch.end_ns - origin_ns) / self._rate)
            if not rclpy.ok():
                return
            self._counts.publish(to_message(replace(batch, stamp_ns=batch.stamp_ns + shift_ns)))
        self._counts.wait_for_all_acked(Duration(seconds=_PATIENCE))
        samples = sum(len(batch.counts) for batch in self._played)
        self.get_logger().info(f"played {samples} samples in {len(self._played)} batches")

    def _spin_until(self, end: float, *, subscribed: bool = False) -> None:
        """Spin until a time on the steady clock [s], or optionally until there is a subscriber."""
        while rclpy.ok() and not (subscribed and self._counts.get_subscription_count()):
            left = end - time.monotonic()
            if left <= 0.0:
                return
            spin_for(self._callbacks, min(left, 0.1))


def main(args: list[str] | None = None) -> int:
    """Run the command; the exit code is 1 if the recording cannot be played."""
    args = sys.argv if args is None else ["play", *args]
    parser = argparse.ArgumentParser(prog="play", description=_DESCRIPTION)
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument(
        "--csv", metavar="FILE", help="recording with time_s,count or time_s,angle_deg as header")
    source.add_argument(
        "--mcap", metavar="FILE", help=f"recording with {COUNTS}, or else {SAMPLES}")
    parser.add_argument("--topic", metavar="NAME", help="topic of --mcap instead")
    parser.add_argument(
        "--rate", type=float, default=1.0, metavar="R",
        help="speed relative to the recording; stamps then deviate from the clock "
        "(default %(default)s)")
    parser.add_argument(
        "--counts-per-turn", type=int, metavar="N",
        help=f"counts in a turn, for a CSV with counts (otherwise {COUNTS_PER_TURN} are assumed)")
    options = parser.parse_args(remove_ros_args(args)[1:])
    if not options.rate > 0.0:
        parser.error(f"--rate must be a positive number, not {options.rate}")
    try:
        if options.mcap:
            _, played = read_batches(
                options.mcap, (options.topic,) if options.topic else (COUNTS, SAMPLES))
        else:
            played = batches(read_csv(options.csv, options.counts_per_turn))
    except (DoorModelError, DoorEncoderError) as error:
        print(f"play: {error}", file=sys.stderr)
        return 1
    return run_node(lambda: PlayNode(played, options.rate), args=args, spin=PlayNode.run)


if __name__ == "__main__":
    sys.exit(main())
