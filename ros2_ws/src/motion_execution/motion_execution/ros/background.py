"""Planning beside the node's callbacks, so that messages are handled meanwhile."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

from door_impact_common.node import GuardedNode, until
from hrp2_description.robot import RobotConfig
from humanoid_motion.robot_model import RobotModel
from walking.errors import Stopped

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

    async def run(
        self, work: Callable[..., Found], *args: Any,
        stopped: Callable[[], bool] = lambda: False,
    ) -> Found:
        """Call a function with the thread's robot as its first argument; await the result.

        Args:
            args: Its further arguments.
            stopped: Whether the result is not wanted any more; the thread finishes it all the same.

        Raises:
            Stopped: The result is not wanted any more.
        """
        pending = self._threads.submit(lambda: work(self._robot.result(), *args))
        await until(self._node, lambda: pending.done() or stopped())
        if stopped():
            raise Stopped("the goal was stopped while its motion was planned; the robot stands")
        return pending.result()

    def close(self) -> None:
        """End the thread after the work that it has begun."""
        self._threads.shutdown(wait=False, cancel_futures=True)
