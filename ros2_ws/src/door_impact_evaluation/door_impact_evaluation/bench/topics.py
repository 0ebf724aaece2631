"""How fast topics and services are, between two processes."""

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

from door_impact_evaluation.bench.bridge import BenchError

TALK = Path(__file__).with_name("talk.py")
_DEFAULT_ROS2 = "/opt/ros/jazzy/setup.bash"
_KEPT = ("HOME", "LANG", "ROS_DOMAIN_ID")  # of the environment, for a ROS 2 beside this one

_RATE, _SECONDS, _TURNS = 200.0, 2.0, 5  # the machine's own speed changes: both in turns
_TRIAL, _STEP = 2.0, 1.25  # of the search for the largest rate: [s], factor
_SLOWEST, _FASTEST = 1000.0, 50_000.0  # [1/s]
_LATE_MS = 20.0  # older messages at the end of a trial mean that they pile up
_CALLS = 1000
_STARTS = 5
_SETTLED = 0.5  # for what is under way to arrive [s]


@dataclass(frozen=True)
class Layer:
    """What two processes talk through: `rclpy` or `dds`, on which topic, how they are started."""

    name: str
    topic: str
    title: str
    command: tuple[str, ...]
    environment: tuple[tuple[str, str], ...] | None = None


def ours() -> Layer:
    """The rclpy of this process's environment."""
    return Layer("rclpy", "bench_ours", "rclpy", (sys.executable,))


@cache
def peer() -> Layer | None:
    """A ROS 2 that ROS2_SETUP names, Cyclone DDS's Python API without ROS, or nothing."""
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
    """One of the two processes."""

    def __init__(self, layer: Layer, role: str) -> None:
        self.started = time.monotonic()
        environment = None if layer.environment is None else dict(layer.environment)
        self._process = subprocess.Popen(
            [*layer.command, str(TALK), layer.name, role, layer.topic], env=environment, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def heard(self) -> dict[str, Any]:
        """Its next line.

        Raises:
            BenchError: It ended instead.
        """
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise BenchError(f"a process of the benchmark ended with {self._process.wait()}")
        told: dict[str, Any] = json.loads(line)
        return told

    def say(self, *words: float) -> None:
        """Writes a line to it."""
        assert self._process.stdin is not None
        self._process.stdin.write(" ".join(map(str, words)) + "\n")
        self._process.stdin.flush()

    def ask(self, *words: float) -> dict[str, Any]:
        """Writes a line to it; gives the line that it answers."""
        self.say(*words)
        return self.heard()

    def end(self) -> None:
        """Ends it."""
        self._process.kill()
        self._process.communicate()


@contextmanager
def talkers(layer: Layer, *roles: str) -> Iterator[list[Talker]]:
    """Starts processes, one after the other, and ends them."""
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
    """A publisher and a subscription that hears it."""
    with talkers(layer, "talk", "listen") as (publisher, listener):
        publisher.heard()
        publisher.ask(_RATE, _SETTLED)
        while not listener.ask()["count"]:
            publisher.ask(_RATE, _SETTLED)
        time.sleep(_SETTLED)
        yield publisher, listener


@cache
def at_200_hz() -> dict[Layer, dict[str, float]]:
    """Latency one way, median and p99 [ms], and share of a core [%] of both processes."""
    with ExitStack() as stack:
        pairs = {layer: stack.enter_context(conversation(layer))
                 for layer in (ours(), peer()) if layer is not None}
        for _, listener in pairs.values():
            listener.ask()
        talked: dict[Layer, list[dict[str, float]]] = {layer: [] for layer in pairs}
        for _ in range(_TURNS):
            for layer, (publisher, _) in pairs.items():
                talked[layer].append(publisher.ask(_RATE, _SECONDS))
                time.sleep(_SETTLED)
        listened = {layer: listener.ask() for layer, (_, listener) in pairs.items()}
    return {layer: _shares(talked[layer], listened[layer]) for layer in pairs}


def _shares(talked: list[dict[str, float]], listened: dict[str, float]) -> dict[str, float]:
    sent = round(_RATE * _SECONDS) * len(talked)
    if lost := sent - listened["count"]:
        raise BenchError(f"{lost} of {sent} messages were lost")
    took = sum(turn["took"] for turn in talked)
    return {"median": listened["median_ms"], "p99": listened["p99_ms"],
            "listener": 100.0 * listened["cpu_s"] / took,
            "publisher": 100.0 * sum(turn["cpu_s"] for turn in talked) / took}


@cache
def largest_rate(layer: Layer) -> float:
    """Rate at which messages still arrive, all and without piling up [1/s]."""
    with conversation(layer) as (publisher, listener):
        best, rate = 0.0, _SLOWEST
        while rate < _FASTEST:
            listener.ask()
            talked = publisher.ask(rate, _TRIAL)
            time.sleep(_SETTLED)
            listened = listener.ask()
            on_time = talked["took"] < 1.05 * _TRIAL
            if not on_time or listened["count"] < round(rate * _TRIAL) or (
                    listened["last_ms"] > _LATE_MS):
                break
            best, rate = rate, rate * _STEP
    return best


@cache
def round_trip(layer: Layer) -> float:
    """Time of a call of a service, median [ms]."""
    with talkers(layer, "serve", "call") as (_, caller):
        caller.heard()
        caller.ask(_CALLS / 10)  # what is made at the first calls
        return float(caller.ask(_CALLS)["median_ms"])


@cache
def start_to_first_message(layer: Layer) -> float:
    """From the start of a process to the first message in its callback, median [s]."""
    times = []
    with talkers(layer, "talk") as (publisher,):
        publisher.heard()
        for _ in range(_STARTS):
            with talkers(layer, "listen") as (listener,):
                while (first := listener.ask()["first"]) is None:
                    publisher.ask(_RATE, _SETTLED)
                times.append(first - listener.started)
    return statistics.median(times)
