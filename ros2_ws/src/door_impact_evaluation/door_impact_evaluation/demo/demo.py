"""Command ``demo``: start every node, run the demonstration, stop every node."""

from __future__ import annotations

import argparse
import fcntl
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path

from door_impact_common.errors import DoorImpactError, OutputError
from door_impact_common.files import make_folder
from door_model.door.config import load_door
from hrp2_description.robot import load_robot_config
from hrp2_sim_bridge.settings import ENGINES, WorldSettings
from impact_planner.task.settings import ENDINGS, RUN_UPS

from door_impact_evaluation.demo.settings import DemoSettings
from door_impact_evaluation.errors import DemoError
from door_impact_evaluation.report import report

LOG = "nodes.log"
UNFINISHED = "unfinished_run"
"""Folder inside the folder of results, in which a run writes until its results are complete."""


class ResultFolder:
    """The folder of a demonstration's results.

    Attributes:
        path: The folder.
        unfinished: Folder inside it for the files of a run that has no results yet.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.unfinished = path / UNFINISHED
        self._lock: int | None = None  # descriptor of the folder, whose lock ends with the process

    def begin(self) -> None:
        """Make an empty folder for a new run; the results of the run before stay untouched.

        Raises:
            OutputError: The folder cannot be made, or another run writes to it.
        """
        self._lock = os.open(make_folder(self.path), os.O_RDONLY)
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise OutputError(
                f"another run writes to the folder {self.path}: wait for its end, or choose "
                "another folder with --out", value=str(self.path)) from error
        shutil.rmtree(self.unfinished, ignore_errors=True)
        make_folder(self.unfinished)

    def release(self) -> None:
        """Let other runs write to the folder."""
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def is_complete(self) -> bool:
        """Return whether the new run has written its results; summary.json is written last."""
        return (self.unfinished / "summary.json").exists()

    def replace(self) -> None:
        """Put the results of the new run in the place of those of the run before.

        A file that the new run did not write is removed: no old file may pass for a new result.
        """
        for name in (*report.FILES, LOG):
            new = self.unfinished / name
            if new.exists():
                new.replace(self.path / name)
            else:
                (self.path / name).unlink(missing_ok=True)
        shutil.rmtree(self.unfinished)


_GRACE = 15.0  # time that the launcher has to stop its nodes before all are killed [s]
_SHOWN = 2000  # characters of the nodes' log that an error shows at most
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def _angle(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value <= 180.0:
        raise argparse.ArgumentTypeError(
            f"the opening angle is {text}, it must be a number above 0 and at most 180 deg")
    return value


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="demo",
        description="Identifies the door, plans the hit, opens the door and reports the result.")
    parser.add_argument("--door", default="paper",
                        help="paper, size2, size3, size4 or a YAML file (default: paper)")
    parser.add_argument("--robot", default="",
                        help="robot.yaml of another robot (default: that of --params, or HRP-2)")
    parser.add_argument("--target-deg", type=_angle, default=25.0,
                        help="desired opening angle [deg] (default: 25)")
    parser.add_argument("--ending", choices=ENDINGS, default="hold",
                        help="what the robot does with the open door; pass: it walks through "
                        "(default: hold)")
    parser.add_argument("--run-up", choices=RUN_UPS, default="mcv50",
                        help="mcv50, the paper's, or zmp_limited, for doors that need a faster "
                        "hit (default: mcv50)")
    parser.add_argument("--hits", type=int, choices=range(1, 6), default=1, metavar="N",
                        help="number of hits, 1 to 5; each hit learns from the hit before, the "
                        "results are those of the last one (default: 1)")
    parser.add_argument("--engine", choices=ENGINES, default=WorldSettings.engine,
                        help=f"physics engine (default: {WorldSettings.engine})")
    parser.add_argument("--gui", choices=("0", "1"), default="0",
                        help="1 opens the physics engine's window")
    parser.add_argument("--params", default="",
                        help="parameter file that every node reads (default: the bringup's)")
    parser.add_argument("--out", type=Path, default=Path("out/demo"),
                        help="folder in which the results are written (default: out/demo)")
    return parser


def _demonstrate(settings: DemoSettings, graph: Mapping[str, str]) -> None:
    """Run a demonstration from the start of the nodes until the results are in their place.

    Args:
        settings: What to do.
        graph: Launch arguments of the nodes.

    Raises:
        DoorImpactError: The demonstration could not be run, or its motion failed.
        KeyboardInterrupt: It was interrupted.
    """
    door = load_door(settings.door)  # errors of files are reported before anything is started
    robot = load_robot_config(graph["robot_config"] or None)
    # Imported here: a wrong command line is refused at once, without loading ROS and the planner.
    from door_impact_bringup.graph import parameters_for, refuse_running_graph
    from humanoid_motion.robot_model import RobotModel
    from impact_planner.task.known_door import KnownDoor

    from door_impact_evaluation.run.rehearsal import planned, world_of

    model, given = RobotModel(robot), graph["params"]
    graph = {**graph, "params": parameters_for(model, given)}
    if not given:  # what the planner will refuse for the door as found, it refuses for the true one
        planned(model, KnownDoor.configured(door), settings.target_deg,
                settings.run_up, settings.ending)
        if robot.file is not None:  # and what its robot.yaml lacks for the simulation
            world_of(model, door, 0.0, engine=graph["engine"]).close()

    refuse_running_graph()
    folder = ResultFolder(settings.out)
    folder.begin()
    try:
        _run_with_nodes(replace(settings, out=folder.unfinished), graph)
    finally:
        if folder.is_complete():
            folder.replace()
            print(f"See {folder.path / 'report.html'} for the replay and the figures.",
                  flush=True)
        else:
            print(f"demo: {folder.path} is left as it was; the files of this run are in "
                  f"{folder.unfinished}", file=sys.stderr)
        folder.release()


def _run_with_nodes(settings: DemoSettings, graph: Mapping[str, str]) -> None:
    from door_impact_evaluation.demo.demo_runner_node import run

    simulation_log, recording = ((settings.out / name).resolve()
                                 for name in ("simulation.npz", report.RECORDING))
    launcher = start_nodes(
        settings.out / LOG, f"door:={settings.door}", "paced:=false",
        *(f"{name}:={value}" for name, value in graph.items() if value),
        f"log_file:={simulation_log}", f"record:={recording}")
    try:
        run(settings, lambda: launcher.poll() is None, lambda: stop_nodes(launcher))
    except DemoError as error:
        if launcher.poll() is None:
            raise
        stop_nodes(launcher)  # so that its log is complete
        raise DemoError(f"{error}\n{_complaints(settings.out / LOG)}") from error
    finally:  # whatever signals arrive meanwhile
        for number in _SIGNALS:
            signal.signal(number, signal.SIG_IGN)
        stop_nodes(launcher)


def _complaints(log: Path) -> str:
    """Return the first warnings and errors of the nodes' log, which cause the others, indented."""
    lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
    return "\n".join(f"    {line}" for line in lines if "[INFO]" not in line and line)[:_SHOWN]


def start_nodes(log: Path, *arguments: str) -> subprocess.Popen[bytes]:
    """Start the nodes of bringup.launch.yaml.

    Args:
        log: File for their output.
        arguments: Arguments of the launch file.

    Returns:
        The launcher, which `stop_nodes` stops.

    Raises:
        GraphError: The ros2 command was not found.
    """
    from door_impact_bringup.graph import launch_command

    with log.open("wb") as file:
        return subprocess.Popen(
            [*launch_command(), *arguments],
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


@contextmanager
def _interruptible() -> Iterator[None]:
    """Let a closed terminal or a supervisor's SIGTERM end the nodes as Ctrl-C does."""
    before = {number: signal.getsignal(number) for number in _SIGNALS}
    for number in _SIGNALS[1:]:
        signal.signal(number, signal.default_int_handler)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def main(args: list[str] | None = None) -> int:
    """Run the demonstration.

    Args:
        args: Command line without the program's name; None means the process's own.

    Returns:
        0 if the door was opened, 1 if something failed, 130 after Ctrl-C.
    """
    options = _parser().parse_args(args)
    settings = DemoSettings(options.door, options.target_deg, options.ending, options.run_up,
                            options.hits, options.out)
    graph = {"engine": options.engine, "gui": options.gui, "robot_config": options.robot,
             "params": options.params}
    try:
        with _interruptible():
            _demonstrate(settings, graph)
    except DoorImpactError as error:
        print(f"demo: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("demo: interrupted, every node was stopped", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
