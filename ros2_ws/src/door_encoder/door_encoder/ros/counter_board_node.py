"""Node counter_board: polls a counter board and publishes its counts."""

import sys
import threading
import time
from dataclasses import replace

import rclpy
from door_impact_common.node import GuardedNode, run_node, spin
from door_impact_common.parameters import Parameters
from door_impact_msgs.msg import EncoderSamples
from door_model.recording.batch import SampleBatch
from door_model.ros.messages import to_message
from rclpy.qos import QoSProfile

from door_encoder.board import PollBatcher, make_board

_PERIOD_NS = 1_000_000  # time between two polls [ns]
_BATCH = 20  # number of samples in a batch, which gives 50 batches per second
_QUEUE = 1000  # 20 s: number of batches that the publisher keeps
_THROTTLE = 5.0  # shortest time between two warnings [s]
_PARAMETERS = {"board": ("", "Class of the counter board as package.module:Class")}


class CounterBoardNode(GuardedNode):
    """Publishes the batches of a `PollBatcher`; it polls in a thread that nothing else delays."""

    def __init__(self) -> None:
        super().__init__("counter_board")
        self._board = make_board(Parameters(self, _PARAMETERS).text("board"))
        self._batcher = PollBatcher(
            period_ns=_PERIOD_NS, size=_BATCH, counts_per_turn=self._board.counts_per_turn)
        self._ended = threading.Event()
        self._error = ""  # latest error of the board that was not reported yet
        self._reported = 0  # number of missed polls that were reported
        self._counts = self.create_publisher(
            EncoderSamples, "door_encoder/counts", QoSProfile(depth=_QUEUE))
        self.create_timer(1.0, self._on_timer)

    def run(self) -> None:
        """Poll until the node is shut down."""
        poller = threading.Thread(target=self._poll, name="poll")
        poller.start()
        try:
            spin(self)
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
            except Exception as error:  # a board is the user's code and may raise anything
                self._error = str(error) or type(error).__name__
                time.sleep(_PERIOD_NS * 1e-9)
                continue
            at = (before + time.monotonic_ns()) // 2
            for batch in self._batcher.take(at, reading):
                self._publish(batch)
            time.sleep(self._batcher.after(time.monotonic_ns()) * 1e-9)

    def _publish(self, batch: SampleBatch) -> None:
        """Publish a batch, with its stamp converted from the steady clock to the node's clock."""
        shift = self.get_clock().now().nanoseconds - time.monotonic_ns()
        try:
            self._counts.publish(to_message(replace(batch, stamp_ns=batch.stamp_ns + shift)))
        except Exception:  # a signal may end the context in the meantime
            if rclpy.ok():
                raise

    def _on_timer(self) -> None:
        """Report polls that were missed."""
        missed = self._batcher.missed
        if missed > self._reported or self._error:
            reason = f"; the board reported: {self._error}" if self._error else ""
            self.get_logger().warning(
                f"polls missed since the start: {missed}{reason}", throttle_duration_sec=_THROTTLE)
            self._reported, self._error = missed, ""


def main(args: list[str] | None = None) -> int:
    """Run the node until it is shut down."""
    return run_node(CounterBoardNode, args=args, spin=CounterBoardNode.run)


if __name__ == "__main__":
    sys.exit(main())
