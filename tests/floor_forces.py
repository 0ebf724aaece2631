"""The ZMP of the simulator's own contact forces, which no node knows, beside the one of sensors."""

from typing import Any

import numpy as np
from door_impact_common.constants import GRAVITY
from hrp2_sim_bridge.sensors.sensors import TickSample
from hrp2_sim_bridge.world import World
from humanoid_motion.kinematics import RobotKinematics
from zmp_publisher.odometry import FootOdometry
from zmp_publisher.zmp_estimator import ZmpEstimator

_POINT, _NORMAL, _FORCE = 6, 7, 9  # places in PyBullet's contact points


class ZmpWatch:
    """Both ZMPs of each tick; called after each of them.

    Attributes:
        time: Of the ticks [s].
        truth: x and y by the contact forces on the floor, mean over the tick [m].
        measured: The same by wrenches and joint angles [m]; NaN where there is none.
    """

    def __init__(self, world: World) -> None:
        robot = world.robot_config
        weight = robot.mass * GRAVITY
        self._odometry = FootOdometry(RobotKinematics(robot), loaded_force=0.05 * weight)
        self._zmp = ZmpEstimator(weight, robot.soles)
        self._world = world
        self._sums = np.zeros(3)
        step = world.client.stepSimulation

        def counted_step() -> None:
            step()
            self._count()

        world.client.stepSimulation = counted_step
        self.time: list[float] = []
        self.truth: list[Any] = []
        self.measured: list[Any] = []

    def _count(self) -> None:
        world = self._world
        for contact in world.client.getContactPoints(world.robot.body, world.floor):
            force = contact[_FORCE] * contact[_NORMAL][2]
            self._sums += force * np.array([*contact[_POINT][:2], 1.0])

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
