"""The process that plans for the node motion_server."""

import os
import signal
from concurrent.futures.process import BrokenProcessPool

import pytest
from motion_execution.ros.planning_process import PlanningProcess


def pid_of(robot: object) -> int:
    """The id of the process that has a robot."""
    assert robot is not None
    return os.getpid()


def end(robot: object) -> None:
    """End the process as the system does where memory is short."""
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_process_that_has_died_is_replaced_by_the_next_work() -> None:
    """Whoever had it work learns that it died."""
    planning = PlanningProcess(None)
    try:
        first = planning.submit(pid_of).result()
        with pytest.raises(BrokenProcessPool):
            planning.submit(end).result()
        assert planning.submit(pid_of).result() not in (first, os.getpid())
    finally:
        planning.close()
