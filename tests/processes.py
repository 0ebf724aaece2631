"""Processes that the tests start, found again and ended whatever becomes of their parents."""

import os
import signal
import subprocess
import time
import uuid
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from door_impact_bringup.graph import find_ros2

GUARD = 600.0  # [s] of wall time after which something hangs; nothing is asserted on it
MARK = "HRP2_TEST_PROCESS"  # in the environment of every process that the tests start


def environments() -> Iterator[tuple[int, dict[str, str]]]:
    """Every process of this machine whose environment can be read."""
    for path in Path("/proc").glob("[0-9]*/environ"):
        with suppress(OSError):
            pairs = path.read_bytes().decode("utf-8", "replace").split("\0")
            yield int(path.parent.name), dict(p.split("=", 1) for p in pairs if "=" in p)


def parameters() -> str:
    """The parameter file of every node."""
    return str(Path(get_package_share_directory("door_impact_bringup")) / "config" / "params.yaml")


def stop_daemon() -> None:
    """End the daemon that ROS 2's commands leave behind in a domain."""
    if "ROS_DISTRO" in os.environ:
        subprocess.run([find_ros2(), "daemon", "stop"], capture_output=True, timeout=GUARD,
                       check=False)


class Started:
    """A process with a session and a mark of its own; its output goes to a file.

    Args:
        command: What to run.
        output: The file.
        environment: Instead of this process's own.
    """

    def __init__(self, command: list[str], output: Path,
                 environment: Mapping[str, str] = os.environ) -> None:
        self.mark = uuid.uuid4().hex
        self.output = output
        with output.open("wb") as file:
            self.process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=file, stderr=subprocess.STDOUT,
                env={**environment, MARK: self.mark, "PYTHONUNBUFFERED": "1"},
                start_new_session=True)

    def text(self) -> str:
        """What it and its children wrote so far."""
        return self.output.read_text(errors="replace")

    def wait_for_text(self, wanted: str) -> "Started":
        """Itself, when a text was written."""
        end = time.monotonic() + GUARD
        while wanted not in self.text():
            assert self.process.poll() is None, self.text()
            assert time.monotonic() < end, f"{wanted!r} never came:\n{self.text()}"
            time.sleep(0.05)
        return self

    def family(self) -> list[int]:
        """Ids of the process and of all it started, whatever their parents are by now."""
        return [pid for pid, environment in environments() if environment.get(MARK) == self.mark]

    def left_over(self, patience: float = 60.0) -> list[int]:
        """Those of them that do not end: orphans get time to notice that their launcher is gone."""
        end = time.monotonic() + patience
        while (left := self.family()) and time.monotonic() < end:
            time.sleep(0.1)
        return left

    def signal_group(self, number: signal.Signals) -> None:
        """Signals the process group, as a terminal does."""
        os.killpg(self.process.pid, number)

    def wait(self) -> int:
        """Exit status."""
        return self.process.wait(GUARD)

    def clean_up(self) -> None:
        """Ends by id whatever is left: the name of a node that is killed stays in the graph."""
        for number in (signal.SIGINT, signal.SIGKILL, signal.SIGKILL):  # one may start another
            for pid in self.family():
                with suppress(ProcessLookupError):
                    os.kill(pid, number)
            self.process.poll()
            self.left_over(20.0)
        self.process.wait()
