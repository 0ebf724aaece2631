"""An executor that looks for work at its own pace, not whenever a message comes."""

from __future__ import annotations

from rclpy.executors import (
    ShutdownException,
    SingleThreadedExecutor,
    TimeoutException,
)

_MOST = 200  # callbacks at once; the rest has to wait for the next time


class PacedExecutor(SingleThreadedExecutor):
    """Runs all callbacks that have work, and then returns.

    Between two calls of `drain` the middleware keeps the last messages of each subscription, as
    many as its depth, and drops the others unread. That costs far less than a callback for each
    of a thousand messages in a second, and a node that is slow delays no other.
    """

    def drain(self) -> int:
        """Run what has work now, without waiting; return the number of callbacks.

        Raises:
            ExternalShutdownException: The context was shut down.
        """
        for count in range(_MOST):
            try:
                run, _, _ = self.wait_for_ready_callbacks(timeout_sec=0.0)
            except (TimeoutException, ShutdownException):
                return count
            run()
        return _MOST
