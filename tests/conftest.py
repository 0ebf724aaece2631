"""Fixtures of the tests that cross packages: commands, the demo, the true door."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import distribution
from pathlib import Path
from typing import Any

import pytest
import yaml
from door_model.data import data_path
from processes import GUARD, Started, find_ros2, stop_daemon
from reference_door import ReferenceDoor


@pytest.fixture(scope="session", autouse=True)
def domain() -> Iterator[int]:
    """The ROS_DOMAIN_ID of this session."""
    yield int(os.environ["ROS_DOMAIN_ID"])
    stop_daemon()


Start = Callable[..., Started]


@pytest.fixture
def start_process(tmp_path: Path) -> Iterator[Start]:
    """Starts a command beside the test and ends it, with its children, after it."""
    processes: list[Started] = []

    def run(command: list[str], environment: Mapping[str, str] = os.environ) -> Started:
        output = tmp_path / f"process_{len(processes)}.txt"
        processes.append(Started(command, output, environment))
        return processes[-1]

    yield run
    for process in processes:
        process.clean_up()


@pytest.fixture
def start(start_process: Start) -> Start:
    """The same for `ros2 ...`."""
    return lambda *arguments: start_process([find_ros2(), *arguments])


@dataclass(frozen=True)
class Done:
    """A command that has ended."""

    status: int
    out: str
    err: str


Ros2 = Callable[..., Done]


def run_command(*command: str) -> Done:
    """Runs a command to its end."""
    done = subprocess.run(command, capture_output=True, text=True, timeout=GUARD,
                          stdin=subprocess.DEVNULL, check=False)
    return Done(done.returncode, done.stdout, done.stderr)


@pytest.fixture(scope="session")
def ros2() -> Ros2:
    """Runs `ros2 ...` to its end."""
    return lambda *arguments: run_command(find_ros2(), *arguments)


@pytest.fixture
def called(capfd: pytest.CaptureFixture[str]) -> Ros2:
    """Calls `ros2 run PACKAGE EXECUTABLE ...` within this process: the same function, no start."""

    def call(package: str, executable: str, *arguments: str) -> Done:
        scripts = distribution(package).entry_points.select(group="console_scripts")
        try:
            status = scripts[executable].load()(list(arguments))
        except SystemExit as end:
            status = end.code
        out, err = capfd.readouterr()
        return Done(status, out, err)

    return call


@pytest.fixture(scope="session")
def python() -> Ros2:
    """Runs Python code, given as a text, to its end."""
    return lambda code, *arguments: run_command(sys.executable, "-c", code, *arguments)


@dataclass(frozen=True)
class Demo:
    """A run of the demonstration."""

    status: int
    text: str
    out: Path
    left_over: list[int]


@pytest.fixture(scope="session")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Demo]:
    """The demonstration, run once as a user would."""
    folder = tmp_path_factory.mktemp("demo")
    out = folder / "out"
    started = Started([find_ros2(), "run", "door_impact_evaluation", "demo", "--out", str(out)],
                      folder / "printed.txt")
    try:
        status = started.process.wait(600.0)
        yield Demo(status, started.text(), out, started.family())
    finally:
        started.clean_up()


@pytest.fixture(scope="session")
def paper_door() -> dict[str, Any]:
    """doors/paper.yaml as it stands in the package."""
    return yaml.safe_load((data_path("doors") / "paper.yaml").read_text())


@pytest.fixture(scope="session")
def reference_door(paper_door: dict[str, Any]) -> Callable[..., ReferenceDoor]:
    """The paper door by the independent eq. (1), other parameters on request."""
    true = {"i_a": paper_door["i_a"], **paper_door["closer"]}
    return lambda **other: ReferenceDoor(**{**true, **other}, linkage=paper_door["linkage"])
