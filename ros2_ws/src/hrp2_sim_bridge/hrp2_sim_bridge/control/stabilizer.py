"""Keeps the robot upright on rubber soles, from what its IMU and foot force sensors say.

The scheme is that of HRP-2's and HRP-4C's stabilizers (Kajita et al., "Biped walking stabilization
based on linear inverted pendulum tracking", IROS 2010): a fed-back tilt asks for a ZMP, the ZMP is
shared between the feet as forces and ankle moments, and each foot gives way until it feels them.
Two things are ours. The rubber's stiffness is known, so a foot is put at once where the rubber
should answer with the wanted force; the damping control only makes up for what is left. And the
feet are held against the floor, not against the body: when the body tilts, they do not.

The joints of HRP-2 are stiff, so the body tilts as a whole about its soles, and the IMU's tilt is
the CoM's error over its height. For an inverted pendulum of mass m and height h,
m h^2 phi'' = m g h phi + M, the moment M = -(m g h + m h^2 w^2) phi - 2 zeta w m h^2 phi' of the
floor places both poles at the frequency w.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY
from door_impact_common.errors import SettingError
from hrp2_description.robot import SIDES, RobotConfig, needed
from humanoid_motion.spline import JointState

from hrp2_sim_bridge.control.stance_reference import Stance, StanceModel
from hrp2_sim_bridge.physics.frames import cross, rotation
from hrp2_sim_bridge.sensors.sensors import TickSample
from hrp2_sim_bridge.settings import TICK

_BEARS = 0.05  # share of the weight above which a sole is on the floor
_FOREIGN = 0.05  # a reference's ZMP so far beyond the soles is not the floor's doing [m]
_EXACT = 1e-6  # [m]
_SINGULAR = 0.01  # damping of the legs' inverse where a knee is straight [m, rad]


@dataclass(frozen=True)
class StabilizerSettings:
    """Gains and bounds of the stabilizer.

    Chosen on a linear model: the body, of moment of inertia 1.2 m h^2, on the rubber of one foot
    or two, in roll and pitch, with the tick's delay and the smoothing. There every mode that swings
    has a damping ratio of at least 0.75 with a rubber 30 % softer or stiffer or with a gain 30 %
    off (0.5 with `damping` itself 30 % lower), and of 0.4 with two ticks of delay more.

    Attributes:
        frequency: of the pendulum's closed loop [rad/s].
        damping: its damping ratio.
        integral_time: in which a lasting tilt doubles its moment [s].
        force_rate: share of a missing force or moment made up in a second [1/s].
        force_memory: time constant with which that is forgotten [s].
        smoothing: time constant of the feet's commands [s].
        soft_start: time in which the corrections come in after a reset [s].
        inset: ZMP so near to a sole's middle, or outside: the sole bears all [m].
        edge: the ankle moments keep the ZMP so far within a sole [m].
        largest_lift: bound of a foot's correction [m].
        largest_angle: the same [rad].
    """

    frequency: float = 4.5
    damping: float = 0.9
    integral_time: float = 2.0
    force_rate: float = 24.0
    force_memory: float = 1.0
    smoothing: float = 0.01
    soft_start: float = 0.2
    inset: float = 0.02
    edge: float = 0.002
    largest_lift: float = 0.025
    largest_angle: float = 0.15

    def __post_init__(self) -> None:
        """Refuse what is no gain.

        Raises:
            SettingError: with the setting, its value and its limit.
        """
        for name in (field.name for field in fields(self)):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise SettingError(name, value, "a positive number")


@dataclass(frozen=True)
class FootLoads:
    """What the feet are to bear, in the level frame; rows are the left and the right foot.

    Attributes:
        force: (2,) normal forces [N].
        moment: (2, 2) about x and y through the soles' middles [N m].
        pivot: (2,) point between the soles about which the body tilts [m].
        beyond: distance of the ZMP that was asked from what the soles can bear [m].
    """

    force: Array
    moment: Array
    pivot: Array
    beyond: float


def share_load(
    zmp: Array,
    normal_force: float,
    centers: Array,
    standing: tuple[bool, bool],
    reach: Array,
    inset: float,
) -> FootLoads:
    """Share a ZMP between the feet: by its place between them, the rest by their ankles.

    Args:
        zmp: (2,) wanted [m].
        normal_force: on both soles [N].
        centers: (2, 2) middles of the left and right sole [m].
        standing: which soles are on the floor, one at least.
        reach: (2,) of the ZMP from a sole's middle along x and y [m].
        inset: a ZMP nearer to a sole's middle than this, or beyond, is borne by it alone [m].
    """
    if all(standing):
        line = centers[0] - centers[1]
        length = math.hypot(line[0], line[1])
        along = float((zmp - centers[1]) @ line) / length
        left = min(max((along - inset) / (length - 2.0 * inset), 0.0), 1.0)
    else:
        left = 1.0 if standing[0] else 0.0
    share = np.array([left, 1.0 - left])
    pivot = share @ centers
    arm = zmp - pivot
    reached = np.clip(arm, -reach, reach)
    force = share * normal_force
    moment = force[:, None] * np.array([reached[1], -reached[0]])
    return FootLoads(force, moment, pivot, float(np.abs(arm - reached).max()))


class Stabilizer:
    """Corrects the reference of the legs, once a control tick.

    Args:
        robot: configuration; its rubber is the one that is reckoned with.
        settings: gains and bounds.
    """

    def __init__(self, robot: RobotConfig, settings: StabilizerSettings | None = None) -> None:
        self.settings = settings or StabilizerSettings()
        self._robot = robot
        self._model = StanceModel(robot)
        self._weight = robot.mass * GRAVITY
        rubber = needed(robot.sole_rubber, "sole_rubber")
        stiffness = rubber.stiffness
        half = self._model.half_size
        self._stiffness = stiffness
        # A rigid sole on four springs at its corners, about x and y.
        self._turn_stiffness = stiffness * half[::-1] ** 2
        self._reach = half - self.settings.edge
        # A command is reached a tick later and smoothed, but the rubber's damping answers early: so
        # far ahead the reference is looked at.
        early = rubber.damping / stiffness
        self._lead = max(1, 1 + round((self.settings.smoothing - early) / TICK))
        angle = self.settings.largest_angle
        self._bound = np.array([self.settings.largest_lift, angle, angle])
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        count = len(self._robot.joint_names)
        self._tilt_sum = np.zeros(2)
        self._made_up = np.zeros((2, 3))
        self._feet = np.zeros((2, 3))
        self._before = np.zeros(count)
        self._after = np.zeros(count)
        self._begin = 0.0
        self._eased = 0.0
        self._coming: deque[tuple[Stance, FootLoads]] = deque(maxlen=self._lead)

    def offsets(self, times: Array) -> Array:
        """Corrections (T, 30) [rad] at times (T,) [s] of the tick that the last update began."""
        share = np.clip((times - self._begin) / TICK, 0.0, 1.0)[:, None]
        return np.asarray(self._before + share * (self._after - self._before))

    def update(self, sample: TickSample, reference: Callable[[float], JointState]) -> None:
        """Choose the correction for the end of the tick that begins now.

        Args:
            sample: what the sensors said at the end of the tick before.
            reference: the uncorrected reference at a time [s].
        """
        now = sample.time
        if not self._coming:
            stance = self._model.at(reference(now))
            self._coming.extend([(stance, self._share(stance.zmp, stance))] * self._lead)
        here, due = self._coming[0]
        tilt, rate = measured_tilt(sample, here)
        self._make_up(sample, here, due)
        stance = self._model.at(reference(now + self._lead * TICK))
        wanted = self._wanted_loads(stance, tilt, rate)
        self._coming.append((stance, wanted))
        feet = self._foot_commands(stance, wanted, tilt) + self._made_up
        # At once, the legs would stretch by the sag and the robot would hop.
        self._eased = min(self._eased + TICK / self.settings.soft_start, 1.0)
        target = self._eased * np.clip(feet, -self._bound, self._bound)
        self._feet += (target - self._feet) * (TICK / (TICK + self.settings.smoothing))
        self._before, self._begin = self._after, now
        robot, position = self._robot, reference(now + TICK).position
        corrected = position + self._joint_offsets(stance)
        self._after = np.clip(corrected, robot.lower, robot.upper) - position

    def _wanted_loads(self, stance: Stance, tilt: Array, rate: Array) -> FootLoads:
        """Loads that carry the reference and set the body upright again."""
        settings = self.settings
        height = float(stance.com[2]) - stance.floor
        inertia = self._robot.mass * height**2
        gain = self._weight * height + inertia * settings.frequency**2
        rate_gain = 2.0 * settings.damping * settings.frequency * inertia
        moment = -gain * (tilt + self._tilt_sum) - rate_gain * rate
        reference = self._share(stance.zmp, stance)
        # What the soles cannot bear is not theirs: at the hit the door brakes the body.
        zmp = stance.zmp if reference.beyond < _FOREIGN else stance.com[:2]
        shift = np.array([-moment[1], moment[0]]) / self._weight
        wanted = self._share(zmp + shift, stance)
        if wanted.beyond < _EXACT:  # else the soles can do no more, however long it lasts
            self._tilt_sum += tilt * (TICK / settings.integral_time)
            np.clip(self._tilt_sum, -settings.largest_angle, settings.largest_angle,
                    out=self._tilt_sum)
        return wanted

    def _share(self, zmp: Array, stance: Stance) -> FootLoads:
        return share_load(
            zmp, stance.normal_force, stance.centers, stance.standing, self._reach,
            self.settings.inset,
        )

    def _foot_commands(self, stance: Stance, wanted: FootLoads, tilt: Array) -> Array:
        """Height [m], roll and pitch [rad] (2, 3) that press the rubber as wanted, level axes."""
        arm = stance.centers - wanted.pivot
        feet = np.empty((2, 3))
        feet[:, 0] = -wanted.force / self._stiffness - (tilt[0] * arm[:, 1] - tilt[1] * arm[:, 0])
        feet[:, 1:] = -wanted.moment / self._turn_stiffness - tilt
        return feet

    def _make_up(self, sample: TickSample, stance: Stance, wanted: FootLoads) -> None:
        """Damping control: each foot gives way to the force that is not wanted."""
        settings = self.settings
        wrenches = np.stack([sample.left_wrench, sample.right_wrench])
        normal = wrenches[:, 2]
        self._made_up *= 1.0 - TICK / settings.force_memory
        for foot in range(len(SIDES)):
            if normal[foot] < _BEARS * self._weight:
                continue
            x, y = self._model.middles[foot]
            about = wrenches[foot, 3:5] - normal[foot] * np.array([y, -x])
            felt = stance.turns[foot][:2, :2] @ about
            step = (felt - wanted.moment[foot]) / self._turn_stiffness
            self._made_up[foot, 1:] += step * (settings.force_rate * TICK)
        if all(stance.standing):
            excess = normal - wanted.force
            step = 0.5 * float(excess[0] - excess[1]) / self._stiffness
            self._made_up[:, 0] += np.array([step, -step]) * (settings.force_rate * TICK)
        np.clip(self._made_up, -self._bound, self._bound, out=self._made_up)

    def _joint_offsets(self, stance: Stance) -> Array:
        """(30,) [rad] that move the feet as commanded."""
        twist = np.zeros((2, 6))
        for foot, (lift, roll, pitch) in enumerate(self._feet):
            turn = stance.turns[foot].T @ np.array([roll, pitch, 0.0])
            middle = np.append(self._model.middles[foot], 0.0)
            twist[foot, :3] = np.array([0.0, 0.0, lift]) - cross(turn, middle)
            twist[foot, 3:] = turn
        legs, turned = stance.legs, stance.legs.transpose(0, 2, 1)
        square = legs @ turned + _SINGULAR**2 * np.eye(6)
        offsets = np.zeros(len(self._robot.joint_names))
        offsets[self._model.leg_joints] = (
            turned @ np.linalg.solve(square, twist[..., None])
        )[..., 0]
        return offsets


def measured_tilt(sample: TickSample, stance: Stance) -> tuple[Array, Array]:
    """Tilt of the body about x and y of the level frame (2,) [rad], and its rate (2,) [rad/s]."""
    up = rotation(sample.imu.orientation)[2]
    tilt = stance.imu @ cross(up, stance.imu[2])
    rate = stance.imu @ (sample.imu.angular_velocity - stance.imu_rate)
    return tilt[:2], rate[:2]
