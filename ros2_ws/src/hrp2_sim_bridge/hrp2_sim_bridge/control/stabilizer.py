"""Keeps the robot upright on rubber soles with its IMU and foot force sensors.

The scheme is that of HRP-2's and HRP-4C's stabilizers (Kajita et al., "Biped walking stabilization
based on linear inverted pendulum tracking", IROS 2010). The measured tilt determines a wanted ZMP,
the ZMP is distributed between the feet as forces and ankle moments, and each foot yields until it
measures them. This version differs in two points. The rubber's stiffness is known, so a foot moves
at once to where the rubber should respond with the wanted force; the damping control only corrects
the remaining difference. And the feet keep their orientation to the floor, not to the body: when
the body tilts, they do not.

The joints of HRP-2 are stiff, so the body tilts as a whole about its soles, and the tilt that the
IMU measures is the CoM's error divided by its height. For an inverted pendulum of mass m and height
h, m h^2 phi'' = m g h phi + M, a moment of the floor
M = -(m g h + m h^2 w^2) phi - 2 zeta w m h^2 phi' gives poles of the natural frequency w and the
damping ratio zeta.

While the robot walks, feedback of the divergent component of motion (DCM) acts beside it: the CoM's
error and its speed over the pendulum's frequency, which follow from tilt and rate as well.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY
from door_impact_common.errors import SettingError
from hrp2_description.robot import SIDES, RobotConfig, needed
from humanoid_motion.driver_interface import TickSample
from humanoid_motion.spline import JointReference

from hrp2_sim_bridge.control.load_sharing import FootLoads, Soles, share_load
from hrp2_sim_bridge.control.stance_reference import ReferenceStance, ReferenceStanceModel
from hrp2_sim_bridge.control.touchdown import Landing, Touchdown
from hrp2_sim_bridge.physics.frames import cross, rotation
from hrp2_sim_bridge.settings import TICK

_BEARS = 0.05  # normal force above which a sole is on the floor, as a share of the weight
_FOREIGN = 0.05  # a reference's ZMP farther outside the soles is not caused by the floor [m]
_EXACT = 1e-6  # distance below which the soles can bear the wanted ZMP [m]
_SINGULAR = 0.01  # damping of the legs' inverse kinematics, for a straight knee [m, rad]


@dataclass(frozen=True)
class StabilizerSettings:
    """Gains and bounds of the stabilizer.

    They were chosen with a linear model: a body with the moment of inertia 1.2 m h^2 on the rubber
    of one foot or of both, in roll and pitch, with the delay of a tick and the smoothing. Every
    oscillating mode of this model has a damping ratio of at least 0.75 if the rubber is 30 % softer
    or stiffer or one gain differs by 30 % (0.5 if `damping` itself is 30 % lower), and of at least
    0.4 with two more ticks of delay. While the robot walks, `dcm_gain` makes it faster and less
    damped.

    Attributes:
        frequency: Natural frequency of the pendulum's closed loop [rad/s].
        damping: Damping ratio of the pendulum's closed loop.
        integral_time: Time in which a constant tilt doubles its moment [s].
        force_rate: Rate at which a missing force or moment is corrected [1/s].
        force_memory: Time constant with which these corrections decay [s].
        search_speed: Speed at which a foot that should have landed is lowered further [m/s].
        smoothing: Time constant of the feet's commands [s].
        rate_smoothing: Time constant of the measured rate of the tilt [s].
        dcm_gain: Additional shift of the ZMP by the error of the DCM while the robot walks.
        dcm_time: Time in which this feedback comes and goes when a walk begins and ends [s].
        soft_start: Time after a reset in which the corrections reach their full size [s].
        inset: Distance of the ZMP from a sole's middle, towards the other sole, at which this sole
            begins to bear the whole weight [m].
        edge: Smallest distance of the ZMP from a sole's edge that the ankle moments keep [m].
        largest_lift: Largest correction of a foot's height [m].
        largest_angle: Largest correction of a foot's roll or pitch [rad].
    """

    frequency: float = 4.5
    damping: float = 0.9
    integral_time: float = 2.0
    force_rate: float = 24.0
    force_memory: float = 1.0
    search_speed: float = 0.05
    smoothing: float = 0.01
    rate_smoothing: float = 0.02
    dcm_gain: float = 1.6
    dcm_time: float = 0.2
    soft_start: float = 0.2
    inset: float = 0.02
    edge: float = 0.002
    largest_lift: float = 0.025
    largest_angle: float = 0.15

    def __post_init__(self) -> None:
        """Check the settings.

        Raises:
            SettingError: A setting is not a positive number.
        """
        for name in (field.name for field in fields(self)):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise SettingError(name, value, "a positive number")


class Stabilizer:
    """Corrects the reference of the legs once in each control tick.

    Args:
        robot: Configuration of the robot, with the rubber that the stabilizer assumes.
        settings: Gains and bounds; the default are those of `StabilizerSettings`.

    Attributes:
        settings: Gains and bounds.

    Raises:
        RobotConfigError: The configuration has no rubber or no IMU.
    """

    def __init__(self, robot: RobotConfig, settings: StabilizerSettings | None = None) -> None:
        self.settings = settings or StabilizerSettings()
        self._robot = robot
        self._model = ReferenceStanceModel(robot)
        self._drives = needed(robot.drives, "drives")
        self._weight = robot.mass * GRAVITY
        rubber = needed(robot.sole_rubber, "sole_rubber")
        stiffness = rubber.stiffness
        half = self._model.half_size
        self._stiffness = stiffness
        # Stiffness of a rigid sole on four springs at its corners against rotation about x and y.
        self._turn_stiffness = stiffness * half[::-1] ** 2
        self._reach = half - self.settings.edge
        self._touchdown = Touchdown(_BEARS * self._weight)
        self._middles = np.column_stack([self._model.middles, np.zeros(2)])
        self._regular = _SINGULAR**2 * np.eye(6)
        # Number of ticks by which the stabilizer looks ahead in the reference: a command is reached
        # one tick later and smoothed, but the rubber's damping responds early.
        early = rubber.damping / stiffness
        self._lead = max(1, 1 + round((self.settings.smoothing - early) / TICK))
        angle = self.settings.largest_angle
        self._bound = np.array([self.settings.largest_lift, angle, angle])
        self.reset()

    def reset(self) -> None:
        """Return to the state without corrections."""
        count = len(self._robot.joint_names)
        self._tilt_sum = np.zeros(2)
        self._rate = np.zeros(2)
        self._made_up = np.zeros((2, 3))
        self._feet = np.zeros((2, 3))
        self._before = np.zeros(count)
        self._after = np.zeros(count)
        self._begin = 0.0
        self._touchdown.reset()
        self._eased = 0.0
        self._walking = 0.0
        self._torque = np.zeros(count)
        self._servo = np.zeros(count)
        self._give = np.zeros(count)
        self._coming: deque[tuple[ReferenceStance, FootLoads]] = deque(maxlen=self._lead)

    def offsets(self, times: Array) -> Array:
        """Return the corrections within the tick that the last `update` began.

        Args:
            times: Times, (T,) [s].

        Returns:
            Corrections of the joint positions, (T, 30) [rad].
        """
        share = ((times - self._begin) / TICK).clip(0.0, 1.0)[:, None]
        return np.asarray(self._before + share * (self._after - self._before))

    def update(self, sample: TickSample, reference: Callable[[float], JointReference]) -> None:
        """Choose the correction for the end of the tick that begins now.

        Args:
            sample: Measurements at the end of the previous tick.
            reference: Function that returns the uncorrected reference at a time [s].
        """
        now = sample.time
        if not self._coming:
            stance = self._model.at(reference(now))
            loads = self._share(stance.zmp, stance, stance.standing)
            self._coming.extend([(stance, loads)] * self._lead)
        here, due = self._coming[0]
        normal = np.array([sample.left_wrench[2], sample.right_wrench[2]])
        landing = self._touchdown.update(normal, due.force, here.heights, here.standing)
        change = TICK / self.settings.dcm_time * (1.0 if landing.walking else -1.0)
        self._walking = min(max(self._walking + change, 0.0), 1.0)
        tilt, rate = measured_tilt(sample, here)
        # Legs with gears that give tremble; an answer to each tremor would keep it alive.
        self._rate += TICK / (TICK + self.settings.rate_smoothing) * (rate - self._rate)
        self._make_up(sample, landing, landing.standing(here.standing), due)
        stance = self._model.at(reference(now + self._lead * TICK))
        standing = landing.standing(stance.standing)
        planned = self._share(stance.zmp, stance, standing)
        wanted = self._wanted_loads(stance, planned, standing, tilt)
        self._coming.append((stance, wanted))
        feet = self._foot_commands(stance, wanted, tilt) + self._made_up
        self._carry(stance, planned, wanted)
        # Without the soft start the legs would stretch at once, and the robot would hop.
        self._eased = min(self._eased + TICK / self.settings.soft_start, 1.0)
        target = self._eased * feet.clip(-self._bound, self._bound)
        self._feet += (target - self._feet) * (TICK / (TICK + self.settings.smoothing))
        self._before, self._begin = self._after, now
        robot, position = self._robot, reference(now + TICK).position
        corrected = position + self._joint_offsets(stance) + self._eased * self._give
        self._after = corrected.clip(robot.lower, robot.upper) - position

    def _wanted_loads(
        self,
        stance: ReferenceStance,
        planned: FootLoads,
        standing: Sequence[bool],
        tilt: Array,
    ) -> FootLoads:
        """Compute loads that carry the reference and bring the body upright."""
        settings = self.settings
        height = float(stance.com[2]) - stance.floor
        inertia = self._robot.mass * height**2
        gain = self._weight * height + inertia * settings.frequency**2
        rate_gain = 2.0 * settings.damping * settings.frequency * inertia
        moment = -gain * (tilt + self._tilt_sum) - rate_gain * self._rate
        # The error of the DCM is that of the CoM and of its speed over the pendulum's frequency.
        dcm = height * (tilt + math.sqrt(height / GRAVITY) * self._rate)
        moment -= self._walking * settings.dcm_gain * self._weight * dcm
        # A ZMP that the soles cannot bear has another cause: in the hit the door brakes the body.
        zmp = stance.zmp if planned.beyond < _FOREIGN else stance.com[:2]
        shift = np.array([-moment[1], moment[0]]) / self._weight
        wanted = self._share(zmp + shift, stance, standing)
        if wanted.beyond < _EXACT:  # otherwise the soles can do no more, and a sum would wind up
            self._tilt_sum += tilt * (TICK / settings.integral_time)
            self._tilt_sum = self._tilt_sum.clip(-settings.largest_angle, settings.largest_angle)
        return wanted

    def _share(
        self, zmp: Array, stance: ReferenceStance, standing: Sequence[bool]
    ) -> FootLoads:
        soles = Soles(stance.centers, stance.turns[:, :2, :2], standing)
        return share_load(zmp, stance.normal_force, soles, self._reach, self.settings.inset)

    def _foot_commands(self, stance: ReferenceStance, wanted: FootLoads, tilt: Array) -> Array:
        """Compute heights [m], rolls and pitches [rad] of the feet that load the rubber as wanted.

        Returns:
            Commands of the left and the right foot in the axes of its sole, (2, 3).
        """
        arm = stance.centers - wanted.pivot
        feet = np.empty((2, 3))
        feet[:, 0] = -wanted.force / self._stiffness - (tilt[0] * arm[:, 1] - tilt[1] * arm[:, 0])
        feet[:, 1:] = -wanted.moment / self._turn_stiffness - tilt.dot(stance.turns[:, :2, :2])
        return feet

    def _make_up(
        self, sample: TickSample, landing: Landing, standing: Sequence[bool], wanted: FootLoads
    ) -> None:
        """Update the damping control: each foot yields to the part of its load that is unwanted.

        A foot that landed early stays where it landed, and one that has not landed is lowered.
        """
        settings = self.settings
        wrenches = np.array([sample.left_wrench, sample.right_wrench])
        normal = wrenches[:, 2]
        self._made_up *= 1.0 - TICK / settings.force_memory
        for foot in range(len(SIDES)):
            if normal[foot] < _BEARS * self._weight:
                continue
            x, y = self._model.middles[foot]
            about = wrenches[foot, 3:5] - normal[foot] * np.array([y, -x])
            step = (about - wanted.moment[foot]) / self._turn_stiffness
            self._made_up[foot, 1:] += step * (settings.force_rate * TICK)
        lower = np.array(landing.late) * (settings.search_speed * TICK)
        self._made_up[:, 0] += landing.descent - lower
        if all(standing):
            excess = normal - wanted.force
            step = 0.5 * float(excess[0] - excess[1]) / self._stiffness
            self._made_up[:, 0] += np.array([step, -step]) * (settings.force_rate * TICK)
        self._made_up = self._made_up.clip(-self._bound, self._bound)

    def _carry(self, stance: ReferenceStance, planned: FootLoads, wanted: FootLoads) -> None:
        """Update the windup of gears and servos under the torques that carry the reference.

        A gear of stiffness k winds up by torque / k. A servo with the gains P and D on position
        and speed yields by an angle e with P e + D e' = torque.
        """
        if planned.beyond > _FOREIGN:
            return  # the floor does not cause this motion, so the joints bear other torques
        torque = stance.effort.copy()
        for foot, share in enumerate(wanted.force / stance.normal_force):
            turn, middle = stance.turns[foot], self._middles[foot]
            force = turn.T.dot(share * stance.force)
            moment = np.array([*wanted.moment[foot], 0.0]) + cross(middle, force)
            load = stance.legs[foot].T.dot(np.concatenate([force, moment]))
            torque[self._model.leg_joints[foot]] -= load
        smooth = TICK / (TICK + self.settings.smoothing)
        self._torque += smooth * (torque - self._torque)
        drives = self._drives
        self._servo = (self._torque + drives.speed_gain / TICK * self._servo) / (
            drives.position_gain + drives.speed_gain / TICK)
        self._give = self._torque / drives.stiffness + self._servo

    def _joint_offsets(self, stance: ReferenceStance) -> Array:
        """Compute the joint corrections that move the feet as commanded, (30,) [rad]."""
        twist = np.zeros((2, 6))
        for foot, (lift, roll, pitch) in enumerate(self._feet):
            turn = np.array([roll, pitch, 0.0])
            twist[foot, :3] = np.array([0.0, 0.0, lift]) - cross(turn, self._middles[foot])
            twist[foot, 3:] = turn
        legs, turned = stance.legs, stance.legs.transpose(0, 2, 1)
        square = legs @ turned + self._regular
        offsets = np.zeros(len(self._robot.joint_names))
        offsets[self._model.leg_joints] = (
            turned @ np.linalg.solve(square, twist[..., None])
        )[..., 0]
        return offsets


def measured_tilt(sample: TickSample, stance: ReferenceStance) -> tuple[Array, Array]:
    """Compute the tilt of the body from the IMU.

    Args:
        sample: Measurements at the end of a tick.
        stance: ReferenceStance of the reference at that time.

    Returns:
        Tilt about x and y of the level frame, (2,) [rad], and its rate, (2,) [rad/s].
    """
    up = rotation(sample.imu.orientation)[2]
    tilt = stance.imu.dot(cross(up, stance.imu[2]))
    rate = stance.imu.dot(sample.imu.angular_velocity - stance.imu_rate)
    return tilt[:2], rate[:2]
