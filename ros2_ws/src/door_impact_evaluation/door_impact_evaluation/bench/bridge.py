"""Measures the physics engines, what the bridge adds to them, and the speed of the whole graph."""

import json
import signal
import subprocess
import sys
from pathlib import Path
from statistics import median
from time import perf_counter, process_time

from door_model.door.config import load_door
from hrp2_description.robot import load_robot_config
from hrp2_sim_bridge.sensors.sensors import TickSample
from hrp2_sim_bridge.settings import TICK
from hrp2_sim_bridge.world import World

from door_impact_evaluation.errors import BenchError
from door_impact_evaluation.run.rehearsal import rehearse

_TARGET_DEG = 25.0  # desired opening angle of the hit [deg]
_FAR = 0.9  # distance of a door that the standing robot is not near to [m]
_STANDING = 400  # ticks of the standing robot that are measured


class _Times:
    """Times of a world's ticks after the first one, in processor time.

    On a machine that has other work to do, wall times are longer than on an idle one. They are
    multiplied by the share of a core that this process got meanwhile. Its processor time is read
    once a tick: reading it around each physics step would take longer than the step.

    Attributes:
        ticks: Number of ticks.
    """

    def __init__(self) -> None:
        self.ticks = -1

    def __call__(self, world: World, sample: TickSample) -> None:
        """Reads the timers after a tick."""
        self._now = (world.wall_time, world.engine.stepping_time, process_time(), perf_counter())
        if self.ticks < 0:
            self._start = self._now
        self.ticks += 1

    def per_second(self) -> tuple[float, float]:
        """Returns the time of the ticks, and of the engine's steps in them, for a second [s]."""
        bridge, engine, processor, wall = (
            now - start for now, start in zip(self._now, self._start, strict=True))
        share = processor / wall / (self.ticks * TICK)
        return share * bridge, share * engine


def engine_step(engine: str) -> float:
    """Measures a physics step of the robot that stands far from the door, without the bridge.

    Args:
        engine: Physics engine.

    Returns:
        Median over the ticks of the mean wall time of a step [us].
    """
    world = World(load_robot_config(), load_door("paper"), _FAR, 0.0, engine=engine, log=False)
    times = []
    try:
        for _ in range(_STANDING):
            before = world.engine.stepping_time
            world.step()
            steps = round(TICK / world.time_step)
            times.append(1e6 * (world.engine.stepping_time - before) / steps)
    finally:
        world.close()
    return median(times)


def overhead(log: Path, engine: str) -> tuple[float, float]:
    """Measures the processor time of a simulated second, over the whole motion and hit.

    Args:
        log: File to which the simulation's log is written.
        engine: Physics engine.

    Returns:
        Processor time of the bridge, and of the physics engine's steps in it [s].
    """
    times = _Times()
    rehearse(_TARGET_DEG, log, watch=times, engine=engine)
    return times.per_second()


def real_time_factor(out: Path, engine: str) -> float:
    """Measures simulated over wall time in a demonstration with every node, as fast as possible.

    Args:
        out: Folder of the demonstration's results.
        engine: Physics engine.

    Raises:
        BenchError: The demonstration failed.
    """
    command = [sys.executable, "-m", "door_impact_evaluation.demo.demo", "--engine", engine,
               "--out", str(out)]
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
