"""Starts and stops every node, as `ros2 launch` does."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

from door_impact_evaluation.errors import EvaluationError

_GRACE = 15.0  # time that the launcher has to stop its nodes before all are killed [s]


def start_nodes(log: Path, *arguments: str) -> subprocess.Popen[bytes]:
    """Start the nodes of bringup.launch.yaml.

    Args:
        log: File for their output.
        arguments: Arguments of the launch file.

    Returns:
        The launcher, which `stop_nodes` stops.

    Raises:
        EvaluationError: The ros2 command was not found.
    """
    own = Path(sys.executable).parent / "ros2"
    command = str(own) if own.exists() else shutil.which("ros2")
    if command is None:
        raise EvaluationError("the ros2 command was not found: run `make setup`, or source ROS 2")
    with log.open("wb") as file:
        return subprocess.Popen(
            [command, "launch", "door_impact_bringup", "bringup.launch.yaml", *arguments],
            stdout=file, stderr=subprocess.STDOUT, start_new_session=True)


def stop_nodes(launcher: subprocess.Popen[bytes]) -> None:
    """Stop the launcher and all its nodes; they are killed if they do not end in time."""
    if launcher.poll() is None:
        launcher.send_signal(signal.SIGINT)
        with suppress(subprocess.TimeoutExpired):
            launcher.wait(_GRACE)
    with suppress(ProcessLookupError):
        os.killpg(launcher.pid, signal.SIGKILL)
    launcher.wait()
