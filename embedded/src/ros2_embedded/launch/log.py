"""Writes the messages of `ros2 launch` and the output of its processes to screen and files."""

from __future__ import annotations

import datetime
import os
import socket
import sys
import time
from contextlib import suppress
from pathlib import Path

_ON_SCREEN = {
    "log": {"stderr"},
    "screen": {"stdout", "stderr"},
    "both": {"stdout", "stderr"},
    "own_log": set(),
    "full": {"stdout", "stderr"},
}
_IN_LAUNCH_LOG = ("log", "both", "full")
_IN_OWN_LOG = ("own_log", "full")


def _base() -> Path:
    """The folder of all logs, as ROS 2 chooses it."""
    if os.environ.get("ROS_LOG_DIR"):
        return Path(os.environ["ROS_LOG_DIR"]).expanduser()
    return Path(os.environ.get("ROS_HOME") or "~/.ros").expanduser() / "log"


class LaunchLog:
    """Writes to the screen, to `launch.log` and to files of single processes."""

    def __init__(self) -> None:
        """Makes the folder, and lets the link `latest` show to it.

        Raises:
            OSError: it cannot be made.
        """
        stamp = datetime.datetime.now().strftime("%Y-%m-%d-%H-%M-%S-%f")
        self.folder = _base() / f"{stamp}-{socket.gethostname()}-{os.getpid()}"
        self.folder.mkdir(parents=True)
        latest = self.folder.with_name("latest")
        if latest.is_symlink() or not latest.exists():
            latest.unlink(missing_ok=True)
            latest.symlink_to(self.folder, target_is_directory=True)

    def say(self, level: str, name: str, text: str) -> None:
        """A line of the launcher's own."""
        _show(f"[{level}] [{name}]: {text}\n")
        self._write("launch.log", f"{time.time():.7f} [{level}] [{name}]: {text}\n")

    def forward(self, label: str, stream: str, text: str, output: str) -> None:
        """Lines that a process wrote.

        Args:
            label: of the process.
            stream: `stdout` or `stderr`.
            text: the lines.
            output: where they go, one of OUTPUTS.
        """
        lines = [f"[{label}] {line}\n" for line in text.split("\n")]
        if stream in _ON_SCREEN[output]:
            _show("".join(lines))
        if output in _IN_LAUNCH_LOG:
            self._write("launch.log", "".join(f"{time.time():.7f} {line}" for line in lines))
        if output in _IN_OWN_LOG:
            for name in (f"{label}-{stream}.log", f"{label}.log"):
                self._write(name, text + "\n")

    def _write(self, name: str, text: str) -> None:
        # On a full disk the lines are lost, but the processes go on, as with ROS 2's launch.
        with suppress(OSError), (self.folder / name).open("a", encoding="utf-8") as file:
            file.write(text)


def _show(text: str) -> None:
    with suppress(OSError):  # stdout may be a file on a full disk
        sys.stdout.write(text)
        sys.stdout.flush()
