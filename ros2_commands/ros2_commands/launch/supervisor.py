"""Start processes, pass on and log what they write, and end them all."""

from __future__ import annotations

import datetime
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO

from ros2_commands.launch.nodes import Process

GRACE = 5.0
"""Time after which a process that has not ended gets the next stronger signal [s]."""

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)
_POLL = 0.05  # [s]
_LAST_LINES = 1.0  # longest wait for what an ended process wrote [s]


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


class _Child:
    """A process that runs, and the threads that read from it."""

    def __init__(self, spec: Process, log: LaunchLog) -> None:
        self.spec, self._log = spec, log
        self.process = subprocess.Popen(
            spec.command, env=spec.environment, stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        )  # fmt: skip
        assert self.process.stdout is not None
        assert self.process.stderr is not None
        log.say("INFO", spec.label, f"process started with pid [{self.process.pid}]")
        self._readers = [
            threading.Thread(target=self._pass_on, args=arguments, daemon=True)
            for arguments in ((self.process.stdout, spec.on_screen), (self.process.stderr, True))
        ]
        for reader in self._readers:
            reader.start()

    def _pass_on(self, stream: IO[bytes], on_screen: bool) -> None:
        traceback: list[str] = []  # whose last line is still to come
        for line in stream:
            text = line.decode("utf-8", "replace").rstrip("\n")
            if text.startswith("Traceback (") or (traceback and text[:1].isspace()):
                traceback.append(text)
                continue
            # Where Ctrl-C met a program, as in its imports, is of no use to who pressed it.
            self._write([*traceback, text], on_screen and not (
                traceback and text.startswith("KeyboardInterrupt")))
            traceback = []
        self._write(traceback, on_screen)

    def _write(self, lines: list[str], on_screen: bool) -> None:
        for text in lines:
            self._log.write(f"[{self.spec.label}] {text}", on_screen)

    def report_end(self) -> None:
        """Say how it ended."""
        for reader in self._readers:
            reader.join(_LAST_LINES)  # a grandchild may hold the stream open
        code, pid, label = self.process.returncode, self.process.pid, self.spec.label
        if code in (0, -signal.SIGINT):
            how = "was interrupted" if code else "has finished cleanly"
            self._log.say("INFO", label, f"process {how} [pid {pid}]")
            return
        command = " ".join(self.spec.command)
        text = f"process has died [pid {pid}, exit code {code}, cmd '{command}']."
        self._log.say("ERROR", label, text)


class Supervisor:
    """Runs processes until all have ended."""

    def __init__(self, log: LaunchLog) -> None:
        """Start nothing yet."""
        self._log = log
        self._running: list[_Child] = []
        self._received: list[int] = []
        self._stage = -1  # index of the last signal that was sent
        self._next_stage = float("inf")

    def run(self, processes: Sequence[Process]) -> None:
        """Start the processes and stay until all have ended."""
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda number, _: self._received.append(number))
        try:
            for spec in processes:
                if not self._received:
                    self._running.append(_Child(spec, self._log))
            while self._running:
                self._step()
        finally:
            for child in self._running:
                child.process.kill()

    def _step(self) -> None:
        time.sleep(_POLL)
        while self._received:
            self._on_signal(self._received.pop(0))
        for child in list(self._running):
            if child.process.poll() is not None:
                self._running.remove(child)
                child.report_end()
                if child.spec.shutdown_on_exit and self._stage < 0:
                    self._escalate()
        if time.monotonic() >= self._next_stage:
            self._escalate()

    def _on_signal(self, number: int) -> None:
        by_user = number == signal.SIGINT
        text = "user interrupted with ctrl-c (SIGINT)" if by_user else "received SIGTERM"
        if self._stage >= 0:
            self._log.say("WARNING", "launch", f"{text} again, ignoring...")
            return
        self._log.say("WARNING", "launch", text)
        # In a terminal, Ctrl-C has reached the processes already, and two would disturb their end.
        self._escalate(send=not (by_user and sys.stdin.isatty()))

    def _escalate(self, send: bool = True) -> None:
        """Send the next, firmer signal to those that still run."""
        self._stage = min(self._stage + 1, len(_SIGNALS) - 1)
        self._next_stage = time.monotonic() + GRACE
        for child in self._running if send else ():
            self._signal(child, _SIGNALS[self._stage])

    def _signal(self, child: _Child, number: signal.Signals) -> None:
        label = child.spec.label
        if self._stage:
            before, waited = _SIGNALS[self._stage - 1].name, self._stage * GRACE
            self._log.say("ERROR", label,
                          f"process[{label}] failed to terminate '{waited:g}' seconds after "
                          f"receiving '{before}', escalating to '{number.name}'")  # fmt: skip
        self._log.say("INFO", label, f"sending signal '{number.name}' to process[{label}]")
        child.process.send_signal(number)
