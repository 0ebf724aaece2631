"""A process that plans, so that no message is late because of a plan."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from hrp2_description.robot import load_robot_config
from humanoid_motion.robot_model import RobotModel


class PlanningProcess:
    """A process with a robot of its own; one that has died is replaced by the next work.

    Args:
        robot_config: Path of robot.yaml; None takes hrp2_description's.
    """

    def __init__(self, robot_config: str | None) -> None:
        self._robot_config = robot_config
        self._begin()

    def submit(self, work: Callable[..., Any], *args: Any) -> Future[Any]:
        """Begin to call a function with the robot as its first argument."""
        try:
            return self._pool.submit(_work, work, *args)
        except BrokenProcessPool:
            self._begin()
            return self._pool.submit(_work, work, *args)

    def close(self) -> None:
        """End the process after the work that it has begun."""
        self._pool.shutdown(wait=False, cancel_futures=True)

    def _begin(self) -> None:
        # A fork would inherit the threads of DDS.
        self._pool = ProcessPoolExecutor(
            max_workers=1, mp_context=multiprocessing.get_context("spawn"),
            initializer=_begin_worker, initargs=(self._robot_config,))
        self._pool.submit(abs, 0)  # begins the process now, not with the first goal


_robot: RobotModel  # of the planning process


def _begin_worker(robot_config: str | None) -> None:
    global _robot
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the node ends it
    _robot = RobotModel(load_robot_config(robot_config))


def _work(work: Callable[..., Any], *args: Any) -> Any:
    return work(_robot, *args)
