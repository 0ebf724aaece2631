"""What somebody has asked a robot for, and may take back."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from robot_driver.motion import Motion
from walking.errors import Stopped

from motion_execution.mission.link import Pending
from motion_execution.mission.routine import until


class Order:
    """An order that is being carried out.

    Args:
        action: Name of what was asked for, such as walk.
        tell: Function that gets the progress now and then.

    Attributes:
        action: Name of what was asked for.
        tell: Function that gets the progress.
        stopped: Whether it was taken back.
        motion: Motion that is being made for it; None between two motions.
    """

    def __init__(self, action: str, tell: Callable[[Any], None] = lambda progress: None) -> None:
        self.action, self.tell = action, tell
        self.stopped = False
        self.motion: Motion | None = None

    def stop(self, why: str = "the motion was stopped, as requested; the robot stands") -> None:
        """Take the order back: the motion under way ends as safely as it can."""
        self.stopped = True
        if self.motion is not None:
            self.motion.stop(why)

    def require(self) -> None:
        """Check that the order was not taken back.

        Raises:
            Stopped: It was.
        """
        if self.stopped:
            raise Stopped(f"{self.action} was stopped before its next motion; the robot stands")


async def result_of(pending: Pending, order: Order) -> Any:
    """Wait for what an order needs, and return it or raise the error that there is instead.

    Raises:
        Stopped: The order was taken back meanwhile.
    """
    await until(lambda: pending.done() or order.stopped)
    order.require()
    return pending.result()
