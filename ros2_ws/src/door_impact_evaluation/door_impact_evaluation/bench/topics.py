"""Measures how fast topics and services are between two processes."""

import json
import os
import shlex
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from door_impact_evaluation.errors import BenchError

TALK = Path(__file__).with_name("talk.py")
_DEFAULT_ROS2 = "/opt/ros/jazzy/setup.bash"
# Environment variables that a ROS 2 installation gets from this process.
_KEPT = ("HOME", "LANG", "ROS_DOMAIN_ID")

_RATE = 200.0   # rate of the messages [1/s]
_SECONDS = 2.0  # duration of a turn [s]
_TURNS = 5      # the speed of a machine varies: this project and its peer are measured in turns
_TRIAL = 2.0    # duration of a trial in the search for the largest rate [s]
_STEP = 1.25    # ratio of the rates of two trials
_SLOWEST, _FASTEST = 1000.0, 50_000.0  # first and largest rate of this search [1/s]
_ON_TIME = 1.05  # largest ratio of the publisher's time to the trial's if it keeps the rate
_LATE_MS = 20.0  # age of the last messages of a trial above which they pile up [ms]
_CALLS = 1000   # calls of the service
_STARTS = 5     # processes that are started
_SETTLED = 0.5  # time after which messages under way have arrived [s]


@dataclass(frozen=True)
class Layer:
    """Software through which two processes exchange messages, and how they are started.

    Attributes:
        name: rclpy or dds, the first argument of talk.py.
        topic: Name of the topic.
        title: Name of the software, for the table.
        command: Command that runs a Python script.
        environment: Environment variables of the processes; None means those of this process.
    """

    name: str
    topic: str
    title: str
    command: tuple[str, ...]
    environment: tuple[tuple[str, str], ...] | None = None


def ours() -> Layer:
    """Returns the rclpy of this process's environment."""
    return Layer("rclpy", "bench_ours", "rclpy", (sys.executable,))


@cache
def peer() -> Layer | None:
    """Returns the software to compare with.

    It is the ROS 2 whose setup files ROS2_SETUP names, separated by colons, else Cyclone DDS's
    Python API without ROS; None if Cyclone DDS is not installed.
    """
    if find_spec("cyclonedds") is None:
        return None
    sources = os.environ.get("ROS2_SETUP", _DEFAULT_ROS2).split(":")
    if not all(map(os.path.isfile, sources)):
        return Layer("dds", "bench_peers", "Cyclone DDS's Python API alone", (sys.executable,))
    clean = {name: os.environ[name] for name in _KEPT if name in os.environ}
    clean |= {"PATH": "/usr/local/bin:/usr/bin:/bin", "RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"}
    sourced = " && ".join(f". {shlex.quote(name)}" for name in sources)
    line = f'{sourced} && export ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST && exec python3 "$@"'
    return Layer("rclpy", "bench_peers", "ROS 2's rclpy on rmw_cyclonedds_cpp",
                 ("bash", "-c", line, "bash"), tuple(clean.items()))


class Talker:
    """One of the two processes, which runs talk.py.

    Args:
        layer: Software to use.
        role: Task of the process: talk, listen, serve or call.

    Attributes:
        started: Time at which the process was started, on the monotonic clock [s].
    """

    def __init__(self, layer: Layer, role: str) -> None:
        self.started = time.monotonic()
        environment = None if layer.environment is None else dict(layer.environment)
        self._process = subprocess.Popen(
            [*layer.command, str(TALK), layer.name, role, layer.topic], env=environment, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def read(self) -> dict[str, Any]:
        """Reads the next line of the process.

        Raises:
            BenchError: The process ended instead.
        """
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise BenchError(f"a process of the benchmark ended with {self._process.wait()}")
        figures: dict[str, Any] = json.loads(line)
        return figures

    def write(self, *numbers: float) -> None:
        """Writes a line of numbers to the process."""
        assert self._process.stdin is not None
        self._process.stdin.write(" ".join(map(str, numbers)) + "\n")
        self._process.stdin.flush()

    def request(self, *numbers: float) -> dict[str, Any]:
        """Writes a line of numbers to the process and returns the line that it responds with.

        Raises:
            BenchError: The process ended instead.
        """
        self.write(*numbers)
        return self.read()

    def end(self) -> None:
        """Ends the process."""
        self._process.kill()
        self._process.communicate()


@contextmanager
def talkers(layer: Layer, *roles: str) -> Iterator[list[Talker]]:
    """Starts a process for each role, one after the other, and ends them all."""
    started: list[Talker] = []
    try:
        for role in roles:
            started.append(Talker(layer, role))
        yield started
    finally:
        for process in started:
            process.end()


@contextmanager
def conversation(layer: Layer) -> Iterator[tuple[Talker, Talker]]:
    """Starts a publisher and a subscriber that receives its messages."""
    with talkers(layer, "talk", "listen") as (publisher, listener):
        publisher.read()
        publisher.request(_RATE, _SETTLED)
        while not listener.request()["count"]:
            publisher.request(_RATE, _SETTLED)
        time.sleep(_SETTLED)
        yield publisher, listener


@cache
def at_200_hz() -> dict[Layer, dict[str, float]]:
    """Measures latency one way, median and p99 [ms], and the CPU use of both processes [%]."""
    with ExitStack() as stack:
        pairs = {layer: stack.enter_context(conversation(layer))
                 for layer in (ours(), peer()) if layer is not None}
        for _, listener in pairs.values():
            listener.request()
        talked: dict[Layer, list[dict[str, float]]] = {layer: [] for layer in pairs}
        for _ in range(_TURNS):
            for layer, (publisher, _) in pairs.items():
                talked[layer].append(publisher.request(_RATE, _SECONDS))
                time.sleep(_SETTLED)
        listened = {layer: listener.request() for layer, (_, listener) in pairs.items()}
    return {layer: _shares(talked[layer], listened[layer]) for layer in pairs}


def _shares(talked: list[dict[str, float]], listened: dict[str, float]) -> dict[str, float]:
    sent = round(_RATE * _SECONDS) * len(talked)
    if lost := sent - listened["count"]:
        raise BenchError(f"{lost} of {sent} messages were lost; none may be")
    took = sum(turn["took"] for turn in talked)
    return {"median": listened["median_ms"], "p99": listened["p99_ms"],
            "listener": 100.0 * listened["cpu_s"] / took,
            "publisher": 100.0 * sum(turn["cpu_s"] for turn in talked) / took}


@cache
def largest_rate(layer: Layer) -> float:
    """Searches the largest rate at which all messages arrive and none pile up [1/s]."""
    with conversation(layer) as (publisher, listener):
        best, rate = 0.0, _SLOWEST
        while rate < _FASTEST:
            listener.request()
            talked = publisher.request(rate, _TRIAL)
            time.sleep(_SETTLED)
            listened = listener.request()
            on_time = talked["took"] < _ON_TIME * _TRIAL
            if not on_time or listened["count"] < round(rate * _TRIAL) or (
                    listened["last_ms"] > _LATE_MS):
                break
            best, rate = rate, rate * _STEP
    return best


@cache
def round_trip(layer: Layer) -> float:
    """Measures the duration of a service call, median [ms]."""
    with talkers(layer, "serve", "call") as (_, caller):
        caller.read()
        caller.request(_CALLS / 10)  # the first calls also create what later calls use
        return float(caller.request(_CALLS)["median_ms"])


@cache
def start_to_first_message(layer: Layer) -> float:
    """Measures the time from the start of a process to its first callback, median [s]."""
    times = []
    with talkers(layer, "talk") as (publisher,):
        publisher.read()
        for _ in range(_STARTS):
            with talkers(layer, "listen") as (listener,):
                while (first := listener.request()["first"]) is None:
                    publisher.request(_RATE, _SETTLED)
                times.append(first - listener.started)
    return statistics.median(times)
