"""A robot and a door without a physics engine: the kinematic double of a driver."""

import math

import numpy as np
import pinocchio as pin
from door_impact_common.constants import GRAVITY
from door_impact_common.errors import DoorImpactError
from humanoid_motion.driver_interface import Driver, ImuSample, TickSample, TrajectoryArrays
from kinematic_world import HAND_RADIUS, Body, Leaf, Reference

TICK = 0.005    # period of the measurements [s]
SAMPLE = 0.001  # period of the door's encoder [s]
COUNTS_PER_TURN, COUNTER = 14400, 2**16
CLOSED_COUNT = 65500  # count at the closed door
UPWARDS = np.array([0.0, 0.0, GRAVITY])  # reading of an accelerometer at rest, in the world [m/s^2]
SLACK = 1e-6  # rounding error of a point that was planned on a limit [rad]


class RefusedError(DoorImpactError):
    """A trajectory was refused."""


class KinematicRobot(Driver):
    """A robot whose joints follow their reference exactly, and the door that it hits.

    Args:
        leaf: The door.

    Attributes:
        body: The robot with its left sole fixed.
        leaf: The door.
        reference: Reference of the joints.
    """

    def __init__(self, leaf: Leaf) -> None:
        self.body = Body()
        self.leaf = leaf
        self.reference = Reference(self.body.config.half_sitting)
        self._steps = 0
        self._push = (0.0, 0.0, 1.0)  # impulse [N m s], start and duration [s]

    @property
    def time(self) -> float:
        """Time since the start [s]."""
        return self._steps * SAMPLE

    def push_door(self, impulse: float, duration: float) -> None:
        """Push the door by hand, beginning now: the torque is half a sine [N m s, s]."""
        self._push = (impulse, self.time, duration)

    def stop(self) -> None:
        """Brake every joint and hold still."""
        self.reference.stop(self.time)

    def follow(self, trajectory: TrajectoryArrays, stamp: float) -> None:
        """Accept a trajectory, or refuse it as a whole.

        Raises:
            RefusedError: The trajectory has other joints, is over, violates a limit, or jumps.
        """
        if trajectory.is_stop:
            self.stop()
            return
        config, given = self.body.config, list(trajectory.joint_names)
        times = (stamp or self.time) + np.array(trajectory.times)
        if sorted(given) != sorted(config.joint_names) or times[-1] <= self.time:
            raise RefusedError("the trajectory has other joints or is over")
        order = [given.index(name) for name in config.joint_names]
        levels = (trajectory.positions, trajectory.velocities, trajectory.accelerations)
        rows = np.array([[np.array(level[point])[order] for level in levels
                          if point < len(level) and len(level[point])]
                         for point in range(len(times))])
        due = times > self.time
        jump = np.abs(rows[due][0, 0] - self.reference.at(self.time)[0]) / max(
            times[due][0] - self.time, TICK)
        inside = (rows[:, 0] >= config.lower - SLACK) & (rows[:, 0] <= config.upper + SLACK)
        if not inside.all() or (jump > 1.1 * config.velocity_limit).any():
            raise RefusedError("the trajectory violates a limit or jumps")
        self.reference.follow(self.time, times[due], rows[due])

    def step(self) -> TickSample:
        """Advance by a tick of 5 ms; return what was measured by its end."""
        before = self.leaf.impulse
        counts = tuple(self._step() for _ in range(round(TICK / SAMPLE)))
        position, velocity, _ = self.reference.at(self.time)
        q, v, a, soles = self.body.motion(self.reference, self.time)
        wrenches = [np.concatenate([wrench.linear, wrench.angular])
                    for wrench in self.body.sole_wrenches(q, v, a, soles)]
        # The robot continues in a hit, so the floor gives the robot at once what the robot gives
        # the door. The soles' moments of the hit are left out.
        for wrench in wrenches:
            wrench[1] -= (self.leaf.impulse - before) / TICK / len(wrenches)  # towards the door
        up = pin.XYZQUATToSE3(q[:7]).rotation.T @ UPWARDS
        imu = ImuSample(q[3:7], v[3:6], a[:3] + np.cross(v[3:6], v[:3]) + up)
        unknown = np.full(len(position), math.nan)
        left, right = wrenches
        return TickSample(self.time, position, velocity, unknown, left, right, imu, counts)

    def _step(self) -> int:
        """Advance by a millisecond; return the count of the door's encoder."""
        self._steps += 1
        impulse, start, length = self._push
        x = (self.time - start) / length
        torque = impulse * math.pi / (2.0 * length) * math.sin(math.pi * x) if x < 1.0 else 0.0
        frames = self.body.place(self.reference.at(self.time)[0])[1]
        self.leaf.step(SAMPLE, torque, (frames[2].translation, self.body.config.contact_radius),
                       (frames[3].translation, HAND_RADIUS))
        turn = self.leaf.angle / (2.0 * math.pi)
        return (CLOSED_COUNT + round(turn * COUNTS_PER_TURN)) % COUNTER
