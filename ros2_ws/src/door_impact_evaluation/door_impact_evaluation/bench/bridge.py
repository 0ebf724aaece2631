"""Measures the time that the bridge adds to PyBullet, and the speed of the whole graph."""

import json
import signal
import subprocess
import sys
from pathlib import Path

from hrp2_sim_bridge.sensors.sensors import TickSample
from hrp2_sim_bridge.settings import TICK
from hrp2_sim_bridge.world import World

from door_impact_evaluation.errors import BenchError
from door_impact_evaluation.run.rehearsal import rehearse

_TARGET_DEG = 25.0  # desired opening angle of the hit [deg]


class _Times:
    """Wall times of a world's ticks after the first one.

    Attributes:
        bridge: Wall time of the ticks [s].
        engine: Wall time that the physics engine needed for its steps in these ticks [s].
        ticks: Number of ticks.
    """

    def __init__(self) -> None:
        self.bridge, self.engine, self.ticks = 0.0, 0.0, -1
        self._start = (0.0, 0.0)

    def __call__(self, world: World, sample: TickSample) -> None:
        """Reads the world's timers after a tick."""
        now = world.wall_time, world.engine.stepping_time
        if self.ticks < 0:
            self._start = now
        self.bridge, self.engine = now[0] - self._start[0], now[1] - self._start[1]
        self.ticks += 1


def overhead(log: Path) -> tuple[float, float]:
    """Measures the wall time of a simulated second, over the whole motion and hit.

    Args:
        log: File to which the simulation's log is written.

    Returns:
        Wall time of the bridge, and of the physics engine's steps in it [s].
    """
    times = _Times()
    rehearse(_TARGET_DEG, log, watch=times)
    seconds = times.ticks * TICK
    return times.bridge / seconds, times.engine / seconds


def real_time_factor(out: Path) -> float:
    """Measures simulated over wall time in a demonstration with every node, as fast as possible.

    Args:
        out: Folder of the demonstration's results.

    Raises:
        BenchError: The demonstration failed.
    """
    command = [sys.executable, "-m", "door_impact_evaluation.demo.demo", "--out", str(out)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                          text=True) as demo:
        try:
            _, complaint = demo.communicate()
        except KeyboardInterrupt:
            demo.send_signal(signal.SIGINT)  # it must stop its nodes
            demo.wait()
            raise
    if demo.returncode:
        raise BenchError(f"the demonstration ended with {demo.returncode}: {complaint}")
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    return float(summary["run"]["real_time_factor"])
