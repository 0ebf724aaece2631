"""Measures the time that the bridge adds to PyBullet, and the speed of the whole graph."""

import json
import signal
import subprocess
import sys
from pathlib import Path
from time import perf_counter

from hrp2_sim_bridge.sensors.sensors import TickSample
from hrp2_sim_bridge.settings import TICK
from hrp2_sim_bridge.world import World

from door_impact_evaluation.errors import BenchError
from door_impact_evaluation.run.rehearsal import rehearse

_BLOCK = 5  # ticks of the bridge before as many ticks of PyBullet alone
_TARGET_DEG = 25.0  # desired opening angle of the hit [deg]


class _TurnTaker:
    """Measures some ticks of the bridge, then PyBullet alone for the same simulated time.

    After PyBullet's own steps the state before them is restored, so they do not change the motion.

    Attributes:
        bridge: Wall time of the ticks [s].
        bare: Wall time of PyBullet's steps alone [s].
        ticks: Number of ticks.
    """

    def __init__(self) -> None:
        self.bridge, self.bare, self.ticks = 0.0, 0.0, 0

    def __call__(self, world: World, sample: TickSample) -> None:
        """Begins after the first tick to measure every further tick."""
        if self.ticks:
            return
        step = world.step
        steps = 0

        def measured() -> TickSample:
            nonlocal steps
            begin = perf_counter()
            sample = step()
            self.bridge += perf_counter() - begin
            self.ticks += 1
            steps += round(TICK / world.time_step)
            if self.ticks % _BLOCK == 0:
                self._step_bare(world, steps)
                steps = 0
            return sample

        world.step = measured  # type: ignore[method-assign]
        measured()

    def _step_bare(self, world: World, steps: int) -> None:
        client = world.client
        state = client.saveState()
        begin = perf_counter()
        for _ in range(steps):
            client.stepSimulation()
        self.bare += perf_counter() - begin
        client.restoreState(state)
        client.removeState(state)


def overhead(log: Path) -> tuple[float, float]:
    """Measures the wall time of a simulated second, over the whole motion and hit.

    Args:
        log: File for the simulation's log.

    Returns:
        Wall time of the bridge, and wall time of PyBullet's steps alone [s].
    """
    taker = _TurnTaker()
    rehearse(_TARGET_DEG, log, watch=taker)
    seconds = taker.ticks * TICK
    return taker.bridge / seconds, taker.bare / seconds


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
