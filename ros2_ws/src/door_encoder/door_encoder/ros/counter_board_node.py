"""Node counter_board: polls a counter board and publishes its counts."""

import sys
import threading
import time
from dataclasses import replace

import rclpy
from door_impact_common.node import fixed, run_node
from door_impact_msgs.msg import EncoderSamples
from rclpy.node import Node
from rclpy.qos import QoSProfile

from door_encoder.board import make_board
from door_encoder.decoding.batch import Batch
from door_encoder.errors import DoorEncoderError
from door_encoder.poll import PollBatcher
from door_encoder.ros.messages import to_message

_PERIOD_NS = 1_000_000
_BATCH = 20  # samples: 50 Hz
_QUEUE = 200  # batches


class CounterBoardNode(Node):
    """Thin shell around `PollBatcher`; polls in a thread that nothing else holds up."""

    def __init__(self) -> None:
        super().__init__("counter_board")
        try:
            self._board = make_board(str(self.declare_parameter("board", "", fixed()).value))
        except DoorEncoderError:
            self.destroy_node()
            raise
        self._batcher = PollBatcher(
            period_ns=_PERIOD_NS, size=_BATCH, counts_per_turn=self._board.counts_per_turn
        )
        self._ended = threading.Event()
        self._error = ""
        self._told = 0
        self._counts = self.create_publisher(
            EncoderSamples, "/door_encoder/counts", QoSProfile(depth=_QUEUE)
        )
        self._timer = self.create_timer(1.0, self._on_timer)

    def run(self) -> None:
        """Poll until the node is told to end."""
        poller = threading.Thread(target=self._poll, name="poll")
        poller.start()
        try:
            rclpy.spin(self)
        finally:
            self._ended.set()
            poller.join()
            self._board.close()

    def _poll(self) -> None:
        """Read the board once in each period."""
        while not self._ended.is_set():
            before = time.monotonic_ns()
            try:
                reading = self._board.read()
            except Exception as error:  # of whoever wrote the board
                self._error = str(error) or type(error).__name__
                time.sleep(_PERIOD_NS * 1e-9)
                continue
            at = (before + time.monotonic_ns()) // 2
            for batch in self._batcher.take(at, reading):
                self._publish(batch)
            time.sleep(self._batcher.after(time.monotonic_ns()) * 1e-9)

    def _publish(self, batch: Batch) -> None:
        """Publish a batch, its stamp moved from the steady clock to the graph's."""
        shift = self.get_clock().now().nanoseconds - time.monotonic_ns()
        try:
            self._counts.publish(to_message(replace(batch, stamp_ns=batch.stamp_ns + shift)))
        except Exception:  # a signal may end the context meanwhile
            if rclpy.ok():
                raise

    def _on_timer(self) -> None:
        """Tell of polls that were missed."""
        missed = self._batcher.missed
        if missed == self._told and not self._error:
            return
        reason = f"; the board said: {self._error}" if self._error else ""
        self.get_logger().warning(
            f"polls missed so far: {missed}{reason}", throttle_duration_sec=5.0
        )
        self._told, self._error = missed, ""


def main(args: list[str] | None = None) -> int:
    """Run the node until it is told to end."""
    return run_node(
        CounterBoardNode, args=args, spin=CounterBoardNode.run
    )


if __name__ == "__main__":
    sys.exit(main())
