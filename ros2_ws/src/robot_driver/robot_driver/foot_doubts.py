"""Doubts about the force sensors of the feet, while one foot alone bears a robot that moves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY
from humanoid_motion.mirror import OTHER
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.samples import NO_IMU, Doubt, Measured

from robot_driver.names import WRENCHES

_UPWARD = np.array([0.0, 0.0, 1.0])
LIFTED = 0.02  # height above the other sole from which a sole is in the air [m]
_FORCE, _TORQUE = 15.0, 2.0  # largest mean force [N] and torque [N m] on a sole in the air
_ENOUGH, _LONGEST = 0.05, 0.5  # time in which a foot is in the air until it is judged [s]
_SWING = 0.2  # shortest such time for the torque of the other foot [s]
_SPEED = 0.025  # time over which a change of posture is a speed [s]
_OFF = 6.0  # largest error of a mean torque; a hand that pushes a leaf makes 10 of it [N m]
_FITS = 0.4  # torques with other axes, which fit better by this factor, are taken for the true ones
_TWICE = 2  # feet in the air, in succession for each foot, after which the axes are doubted
_PARTS = [f"{kind}.{axis}" for kind in ("force", "torque") for axis in "xyz"]
_AXES = [(f"({', '.join('-' * (sign < 0) + _PARTS[3 + axis] for axis, sign in read)})",
          np.array([sign * np.eye(2)[axis] for axis, sign in read]))
         for order in ((0, 1), (1, 0)) for signs in product((1, -1), repeat=2)
         for read in [list(zip(order, signs, strict=True))]]


def lifted(soles: Mapping[str, Array], vertical: Array = _UPWARD) -> str:
    """Return the side of the sole that joints show in the air; empty: none.

    Args:
        soles: Pose of each sole in one frame, by side, (4, 4).
        vertical: Direction upward in this frame, (3,).
    """
    above = float(vertical @ (soles["left"][:3, 3] - soles["right"][:3, 3]))
    return "" if abs(above) <= LIFTED else "left" if above > 0.0 else "right"


def lying(air: str, forces: Mapping[str, float]) -> str:
    """Return the side in the air whose force is no load; empty: none, or exchanged sensors."""
    return air if air and forces[air] < forces[OTHER[air]] else ""


class FootDoubts:
    """Compares the feet's wrenches with joints and CoM, each time a foot has been in the air.

    Then that foot bears nothing, and the torque on the other one changes the angular momentum.

    Args:
        robot: The robot.
    """

    def __init__(self, robot: RobotModel) -> None:
        self._robot = robot
        self.begin()

    def begin(self) -> None:
        """Begin anew."""
        self._air, self._flight = "", []  # type: tuple[str, list[tuple[Measured, Array, Array]]]
        self._offset: dict[str, Doubt] = {}
        self._turned: dict[str, tuple[str, int, Doubt]] = {}

    @property
    def found(self) -> list[Doubt]:
        """The doubts: what was found when each foot was in the air for the last time."""
        turned = list(self._turned.values())
        sure = sum(times for _, times, _ in turned) >= _TWICE
        return [*self._offset.values(), *(doubt for *_, doubt in turned if sure)]

    def add(self, measured: Measured, base: Array, soles: Mapping[str, Array]) -> None:
        """Take a sample with the poses (4, 4) of base_link and of each sole in odom."""
        air = lifted(soles)
        flight = self._flight
        if flight and (air != self._air or measured.time - flight[0][0].time > _LONGEST):
            self._judge()
            flight.clear()
        self._air = air
        if air:
            configuration = self._robot.configuration(base[:3, 3], measured.position)
            configuration[3:7] = pin.Quaternion(base[:3, :3]).coeffs()
            flight.append((measured, configuration, soles[OTHER[air]]))

    def _judge(self) -> None:
        times = np.array([sample.time for sample, *_ in self._flight])
        if times[-1] - times[0] < _ENOUGH:
            return
        wrenches = {side: np.array([getattr(sample, f"{side}_wrench") for sample, *_ in
                                    self._flight]) for side in WRENCHES}
        air, other = self._air, OTHER[self._air]
        mean = wrenches[air].mean(axis=0)
        exchanged = mean[2] > wrenches[other][:, 2].mean()
        worst = int(np.argmax(np.abs(mean) / np.repeat([_FORCE, _TORQUE], 3)))
        limit, unit = (_FORCE, "N") if worst < 3 else (_TORQUE, "N m")
        self._offset.pop(air, None)
        if abs(mean[worst]) > limit:
            cause = "are the feet's wrenches exchanged" if exchanged else "is this its offset"
            self._offset[air] = Doubt(
                WRENCHES[air], f"by the joints this sole was over {1e3 * LIFTED:g} mm above the "
                f"other one, but {_PARTS[worst]} was {mean[worst]:.1f} {unit} in the mean, at most "
                f"{limit:g} {unit} are expected: {cause}?", float(mean[worst]), False)
        # Without an IMU nobody knows how the sole tilts on its rubber.
        known = all(sample.imu is not NO_IMU for sample, *_ in self._flight)
        if times[-1] - times[0] >= _SWING and known and not exchanged:
            self._judge_axes(other, times, wrenches[other][:, 3:5])

    def _judge_axes(self, side: str, times: Array, torques: Array) -> None:
        """Compare the mean torque on the foot that bears the robot with what joints show."""
        begin = int(np.searchsorted(times, times[0] + _SPEED))
        first, last = self._momentum(0, begin), self._momentum(-1 - begin, -1)
        inside = (times >= first[0]) & (times <= last[0])
        model, sole = self._robot, self._flight[len(times) // 2][2]
        postures = [row[1] for row, within in zip(self._flight, inside, strict=True) if within]
        lever = np.mean([model.com(each) for each in postures[::4]], axis=0) - sole[:3, 3]
        weight = np.array([0.0, 0.0, -model.config.mass * GRAVITY])
        moment = sole[:3, :3].T @ (
            (last[1] - first[1]) / (last[0] - first[0]) - np.cross(lever, weight))
        mean = torques[inside].mean(axis=0)
        errors = [float(np.linalg.norm(axes @ mean - moment[:2])) for _, axes in _AXES]
        best = int(np.argmin(errors))
        name, before = _AXES[best][0], self._turned.pop(side, None)
        if errors[0] > _OFF and errors[best] < _FITS * errors[0]:
            times_before = before[1] if before is not None and before[0] == name else 0
            self._turned[side] = name, times_before + 1, Doubt(
                WRENCHES[side], "(torque.x, torque.y) of this sole, which bore the robot alone, "
                f"was {_told(mean)} N m in the mean, but {_told(moment)} N m by joints and CoM in "
                f"motion, which differ by {errors[0]:.1f} N m, at most {_OFF:g} N m are expected: "
                f"do its axes point elsewhere? {name} fits", errors[0], False)

    def _momentum(self, first: int, last: int) -> tuple[float, Array]:
        """Time between two samples [s], and the angular momentum about the other sole, (3,)."""
        (one, before, _), (two, after, _) = self._flight[first], self._flight[last]
        model, data = self._robot.model, self._robot.data
        speed = pin.difference(model, before, after) / (two.time - one.time)
        pin.computeCentroidalMomentum(
            model, data, pin.interpolate(model, before, after, 0.5), speed)
        lever = data.com[0] - self._flight[len(self._flight) // 2][2][:3, 3]
        return 0.5 * (one.time + two.time), np.asarray(
            data.hg.angular + np.cross(lever, data.hg.linear))


def _told(torque: Sequence[float] | Array) -> str:
    return f"({torque[0]:.1f}, {torque[1]:.1f})"
