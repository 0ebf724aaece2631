"""The ZMP of the simulator's own contact forces, compared with the ZMP of the sensors."""

from typing import Any

import numpy as np
from door_impact_common.constants import GRAVITY
from hrp2_sim_bridge.physics.engine import Engine
from hrp2_sim_bridge.world import World
from humanoid_motion.driver_interface import TickSample
from humanoid_motion.robot_model import RobotModel
from zmp_publisher.odometry import FootOdometry
from zmp_publisher.zmp_estimator import ZmpEstimator


class ZmpWatch:
    """Records both ZMPs of each tick; it is called after each tick.

    Attributes:
        time: Times of the ticks [s].
        truth: x and y of the ZMP from the contact forces on the floor, mean over the tick [m].
        measured: x and y of the ZMP from wrenches and joint angles [m]; NaN without a ZMP.
    """

    def __init__(self, world: World) -> None:
        robot = world.robot_config
        weight = robot.mass * GRAVITY
        self._odometry = FootOdometry(RobotModel(robot), loaded_force=0.05 * weight)
        self._zmp = ZmpEstimator(weight, robot.soles)
        self._sums = np.zeros(3)
        world.observers.append(self._count)
        self.time: list[float] = []
        self.truth: list[Any] = []
        self.measured: list[Any] = []

    def _count(self, engine: Engine) -> None:
        """Sum the vertical forces and their moments after a physics step."""
        for contact in engine.floor_contacts():
            self._sums += contact.force[2] * np.array([*contact.point[:2], 1.0])

    def __call__(self, world: World, sample: TickSample) -> None:
        wrenches = {"left": sample.left_wrench, "right": sample.right_wrench}
        pose = self._odometry.update(sample.position, {s: w[2] for s, w in wrenches.items()})
        reading = None if pose is None else self._zmp.read(pose.soles, wrenches)
        self.time.append(sample.time)
        self.truth.append(self._sums[:2] / self._sums[2] if self._sums[2] > 0 else [np.nan] * 2)
        self.measured.append([np.nan] * 2 if reading is None else reading.point)
        self._sums = np.zeros(3)

    def rms(self, start: float, end: float) -> float:
        """Root mean square of the distance between both in a span of time [m]."""
        time = np.array(self.time)
        rows = (time >= start) & (time < end)
        off = np.array(self.measured)[rows] - np.array(self.truth)[rows]
        assert np.isfinite(off).mean() > 0.98
        return float(np.sqrt(np.nanmean((off**2).sum(axis=1))))
