"""The messages of `ros2 launch` and the output of its processes, on the screen and in a file."""

from __future__ import annotations

import datetime
import os
import socket
import threading
import time
from contextlib import suppress
from pathlib import Path


class LaunchLog:
    """Writes lines to the screen and to `launch.log` below ROS 2's folder of logs."""

    def __init__(self) -> None:
        """Make the folder.

        Raises:
            OSError: It cannot be made.
        """
        home = Path(os.environ.get("ROS_HOME") or "~/.ros")
        base = Path(os.environ.get("ROS_LOG_DIR") or home / "log").expanduser()
        stamp = datetime.datetime.now().strftime("%Y-%m-%d-%H-%M-%S-%f")
        self.folder = base / f"{stamp}-{socket.gethostname()}-{os.getpid()}"
        self.folder.mkdir(parents=True)
        self._lock = threading.Lock()

    def say(self, level: str, name: str, text: str) -> None:
        """Write a message of the launcher's own; `level` as INFO, `name` of what it is about."""
        self.write(f"[{level}] [{name}]: {text}")

    def write(self, line: str, on_screen: bool = True) -> None:
        """Write a line, to the screen only if it is wanted there."""
        # On a full disk or a closed screen the lines are lost, but the processes go on.
        with self._lock, suppress(OSError):
            with (self.folder / "launch.log").open("a", encoding="utf-8") as file:
                file.write(f"{time.time():.7f} {line}\n")
            if on_screen:
                print(line, flush=True)
