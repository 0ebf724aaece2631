"""`make demo`: starts every node, runs the demonstration, stops every node."""

import argparse
import math
import os
import shutil
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

from door_impact_bringup.mcap_file import partial_folder
from door_model.door.config import load_door
from door_model.errors import DoorModelError

from door_impact_evaluation.errors import DemoError, NodeEndedError
from door_impact_evaluation.report import report

GRACE = 15.0  # [s] that the launcher gets to stop its nodes before it is ended


def _angle(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or value <= 0.0:
        raise argparse.ArgumentTypeError(f"an opening angle is a number above 0 deg, got {text}")
    return value


def _switch(text: str) -> bool:
    if text not in ("0", "1"):
        raise argparse.ArgumentTypeError(f"0 or 1, got {text}")
    return text == "1"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="demo",
        description="Finds out the door, plans the hit, opens the door, shows the result.")
    parser.add_argument("--door", default="paper",
                        help="paper, size2, size3, size4 or a YAML file (default: paper)")
    parser.add_argument("--target-deg", type=_angle, default=25.0,
                        help="desired opening angle [deg] (default: 25)")
    parser.add_argument("--ending", choices=("hold", "retreat"), default="hold",
                        help="what the robot does with the open door (default: hold)")
    parser.add_argument("--run-up", choices=("mcv50", "zmp_limited"), default="mcv50",
                        help="mcv50, as the paper, or zmp_limited, for doors that take a faster "
                        "hit (default: mcv50)")
    parser.add_argument("--hits", type=int, choices=range(1, 6), default=1, metavar="N",
                        help="how often the door is hit, 1 to 5; each hit learns from the one "
                        "before, the results are the last one's (default: 1)")
    parser.add_argument("--gui", type=_switch, default=False, help="1 opens a PyBullet window")
    parser.add_argument("--out", type=Path, default=Path("out/demo"),
                        help="where the results are written (default: out/demo)")
    return parser


def _ros2() -> str:
    """The ros2 command beside this interpreter, or the one on the path."""
    beside = Path(sys.executable).parent / "ros2"
    command = str(beside) if beside.exists() else shutil.which("ros2")
    if command is None:
        raise DemoError("the ros2 command was not found: run `make setup`, or source ROS 2")
    return command


def _stop(launcher: subprocess.Popen[bytes]) -> None:
    """Ends the launcher and whatever it has left."""
    if launcher.poll() is None:
        launcher.send_signal(signal.SIGINT)
        with suppress(subprocess.TimeoutExpired):
            launcher.wait(GRACE)
    with suppress(ProcessLookupError):
        os.killpg(launcher.pid, signal.SIGKILL)
    launcher.wait()


def _run(options: argparse.Namespace) -> None:
    try:
        load_door(options.door)
    except DoorModelError as error:
        raise DemoError(str(error)) from error
    from door_impact_evaluation.demo.demo_runner_node import refuse_running_graph, run

    out: Path = options.out
    out.mkdir(parents=True, exist_ok=True)
    for name in report.FILES:  # an old result must not pass for this one
        (out / name).unlink(missing_ok=True)
    simulation_log, recording = ((out / name).resolve()
                                 for name in ("simulation.npz", report.RECORDING))
    shutil.rmtree(partial_folder(recording), ignore_errors=True)  # of one that was killed
    refuse_running_graph()
    with (out / "nodes.log").open("wb") as log:
        launcher = subprocess.Popen(
            [_ros2(), "launch", "door_impact_bringup", "bringup.launch.yaml",
             f"door:={options.door}", f"gui:={int(options.gui)}", "paced:=false",
             f"log_file:={simulation_log}", f"record:={recording}"],
            stdout=log, stderr=subprocess.STDOUT, start_new_session=True)
        try:
            run(door=options.door, target_deg=options.target_deg, ending=options.ending,
                run_up=options.run_up, hits=options.hits, out=out,
                nodes_alive=lambda: launcher.poll() is None)
        except NodeEndedError as error:
            _stop(launcher)
            raise DemoError(f"{error}\n{_complaints(out / 'nodes.log')}") from error
        finally:
            _stop(launcher)


def _complaints(log: Path) -> str:
    """The last lines of a log that are no mere information, indented."""
    lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
    return "\n".join(f"    {line}" for line in lines if "[INFO]" not in line and line)[-2000:]


def main(args: list[str] | None = None) -> int:
    """Runs the demonstration.

    Args:
        args: Command line, without the program's name; the process's own by default.

    Returns:
        0 when the door was opened, 1 when something failed, 130 after Ctrl-C.
    """
    options = _parser().parse_args(args)
    # A terminal closed or a supervisor's SIGTERM must end the nodes as Ctrl-C does.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    signal.signal(signal.SIGHUP, signal.default_int_handler)
    try:
        _run(options)
    except DemoError as error:
        print(f"demo: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("demo: interrupted, every node was stopped", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
