"""Planning beside the node's callbacks, so that messages are handled meanwhile."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, TypeVar

from door_impact_common.node import GuardedNode
from hrp2_description.robot import RobotConfig
from humanoid_motion.robot_model import RobotModel
from rclpy.clock import Clock, ClockType
from rclpy.task import Future

_PERIOD = 0.005  # time between two looks whether a plan is ready, by the computer's clock [s]

Found = TypeVar("Found")


class Background:
    """One thread with a robot of its own, because a `RobotModel` cannot be shared.

    Args:
        node: Node in whose coroutines the results are awaited.
    """

    def __init__(self, node: GuardedNode, config: RobotConfig) -> None:
        self._node = node
        self._threads = ThreadPoolExecutor(max_workers=1, thread_name_prefix="planning")
        self._robot = self._threads.submit(RobotModel, config)

    async def run(self, work: Callable[..., Found], *args: Any) -> Found:
        """Call a function with the thread's robot as its first argument; await the result.

        Args:
            args: Its further arguments.
        """
        pending = self._threads.submit(lambda: work(self._robot.result(), *args))
        await self.until(pending.done)
        return pending.result()

    async def until(self, condition: Callable[[], bool], patience: float = math.inf) -> None:
        """Wait until a condition holds, by looking again and again.

        Args:
            patience: Longest time to wait, by the computer's clock [s].
        """
        end = time.monotonic() + patience
        while not condition() and time.monotonic() < end:
            later = Future()
            timer = self._node.create_timer(_PERIOD, partial(later.set_result, None),
                                            clock=Clock(clock_type=ClockType.STEADY_TIME))
            await later
            self._node.destroy_timer(timer)

    def close(self) -> None:
        """End the thread after the work that it has begun."""
        self._threads.shutdown(wait=False, cancel_futures=True)
