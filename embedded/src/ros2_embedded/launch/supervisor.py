"""Starts processes, passes on what they write, and ends them all."""

from __future__ import annotations

import ctypes
import os
import selectors
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from ros2_embedded.launch.description import LaunchPlan
from ros2_embedded.launch.log import LaunchLog
from ros2_embedded.launch.processes import ProcessSpec

GRACE = 5.0
"""Time until a process that has not ended receives the next stronger signal [s]."""

_ESCALATION = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)
_PR_SET_PDEATHSIG = 1
_libc = ctypes.CDLL(None, use_errno=True) if sys.platform.startswith("linux") else None


def _die_with_parent(parent: int) -> None:
    """Runs in the child before its program: the kernel kills it when the launcher is gone."""
    if _libc is not None:
        _libc.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:
            os._exit(1)


@dataclass
class _Child:
    """A process that has been started."""

    spec: ProcessSpec
    process: subprocess.Popen[bytes]
    partial: dict[int, bytes] = field(default_factory=dict)
    ended: bool = False

    def signal_group(self, number: int) -> None:
        """Signals the process and what it has started."""
        with suppress(ProcessLookupError):
            os.killpg(self.process.pid, number)


class Supervisor:
    """Runs a list of processes until all have ended."""

    def __init__(self, plan: LaunchPlan, log: LaunchLog) -> None:
        """Nothing is started yet."""
        self._log = log
        self._messages, self._specs = plan.messages, plan.processes
        self._children: list[_Child] = []
        self._selector = selectors.DefaultSelector()
        self._wake_read, self._wake_write = os.pipe()
        self._stage = -1
        self._next_stage = float("inf")
        self._failed = False

    def run(self) -> int:
        """Starts the processes and stays until all have ended.

        Returns:
            0, or 1 if a process could not be started: one that died is no failure, as in ROS 2.
        """
        os.set_blocking(self._wake_read, False)
        os.set_blocking(self._wake_write, False)
        numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGCHLD)
        previous = {number: signal.signal(number, lambda *_: None) for number in numbers}
        previous_fd = signal.set_wakeup_fd(self._wake_write, warn_on_full_buffer=False)
        self._selector.register(self._wake_read, selectors.EVENT_READ, None)
        try:
            for message in self._messages:
                self._log.say("INFO", "launch.user", message)
            for spec in self._specs:
                if self._stage < 0:
                    self._start(spec)
            while not all(child.ended for child in self._children):
                self._step()
        finally:
            self._kill_rest()
            signal.set_wakeup_fd(previous_fd)
            for number, handler in previous.items():
                signal.signal(number, handler)
            self._selector.close()
            os.close(self._wake_read)
            os.close(self._wake_write)
        return int(self._failed)

    def _start(self, spec: ProcessSpec) -> None:
        parent = os.getpid()
        try:
            process = subprocess.Popen(
                spec.command,
                env={**spec.environment, "PYTHONUNBUFFERED": "1"},
                cwd=spec.cwd,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                start_new_session=True,
                preexec_fn=lambda: _die_with_parent(parent),
            )
        except OSError as error:
            self._log.say("ERROR", spec.label, f"process could not be started: {error}")
            self._failed = True
            self._shut_down()
            return
        child = _Child(spec, process)
        self._children.append(child)
        for stream in (process.stdout, process.stderr):
            assert stream is not None
            os.set_blocking(stream.fileno(), False)
            self._selector.register(stream, selectors.EVENT_READ, child)
        self._log.say("INFO", spec.label, f"process started with pid [{process.pid}]")

    def _step(self) -> None:
        timeout = max(0.0, self._next_stage - time.monotonic())
        for key, _ in self._selector.select(None if timeout == float("inf") else timeout):
            if key.data is None:
                self._on_signals(os.read(self._wake_read, 4096))
            else:
                self._forward(key.data, key.fileobj)
        self._reap()
        if time.monotonic() >= self._next_stage:
            self._escalate()

    def _on_signals(self, numbers: bytes) -> None:
        if signal.SIGINT in numbers and self._stage < 0:
            self._log.say("WARNING", "launch", "user interrupted with ctrl-c (SIGINT)")
            self._shut_down()
        if signal.SIGTERM in numbers and self._stage < 0:
            self._log.say("INFO", "launch", "received SIGTERM")
            self._shut_down()

    def _forward(self, child: _Child, stream: Any) -> None:
        """Passes on whole lines, each with the process's label."""
        try:
            data = stream.read()
        except ValueError:
            return
        if data is None:
            return
        if not data:
            self._selector.unregister(stream)
            self._print(child, stream, child.partial.pop(id(stream), b""))
            return
        text = child.partial.get(id(stream), b"") + data
        head, newline, tail = text.rpartition(b"\n")
        child.partial[id(stream)] = tail
        if newline:
            self._print(child, stream, head)

    def _print(self, child: _Child, stream: Any, data: bytes) -> None:
        if data:
            name = "stdout" if stream is child.process.stdout else "stderr"
            text = data.decode("utf-8", "replace")
            self._log.forward(child.spec.label, name, text, child.spec.output)

    def _reap(self) -> None:
        for child in self._children:
            if child.ended or child.process.poll() is None:
                continue
            child.ended = True
            for stream in (child.process.stdout, child.process.stderr):
                if stream in self._selector.get_map():
                    self._forward(child, stream)
            child.signal_group(signal.SIGKILL)  # its remaining child processes
            self._report(child)
            if child.spec.shutdown_on_exit:
                self._shut_down()

    def _report(self, child: _Child) -> None:
        code, pid = child.process.returncode, child.process.pid
        if code == 0:
            self._log.say("INFO", child.spec.label, f"process has finished cleanly [pid {pid}]")
            return
        command = " ".join(child.spec.command)
        text = f"process has died [pid {pid}, exit code {code}, cmd '{command}']."
        self._log.say("ERROR", child.spec.label, text)

    def _shut_down(self) -> None:
        if self._stage < 0:
            self._escalate()

    def _escalate(self) -> None:
        """Sends the next, firmer signal to those that still run."""
        self._stage = min(self._stage + 1, len(_ESCALATION) - 1)
        number = _ESCALATION[self._stage]
        for child in self._children:
            if child.ended:
                continue
            label = child.spec.label
            if self._stage:
                before = _ESCALATION[self._stage - 1].name
                waited = f"{GRACE:g}" if self._stage == 1 else f"{2 * GRACE}"
                self._log.say(
                    "ERROR",
                    label,
                    f"process[{label}] failed to terminate '{waited}' seconds after receiving "
                    f"'{before}', escalating to '{number.name}'",
                )
            self._log.say("INFO", label, f"sending signal '{number.name}' to process[{label}]")
            child.signal_group(number)
        self._next_stage = time.monotonic() + GRACE

    def _kill_rest(self) -> None:
        for child in self._children:
            if child.process.poll() is None:
                child.signal_group(signal.SIGKILL)
                child.process.wait()
