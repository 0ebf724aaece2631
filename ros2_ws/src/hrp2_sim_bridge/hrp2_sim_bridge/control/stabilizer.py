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

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY
from humanoid_motion.driver_interface import TickSample
from humanoid_motion.spline import JointReference

from hrp2_sim_bridge.control.feet import FootLoads, Landing, Touchdown, share_load
from hrp2_sim_bridge.control.stance_reference import ReferenceStance, ReferenceStanceModel
from hrp2_sim_bridge.physics.engine import SimulatedRobot
from hrp2_sim_bridge.physics.frames import cross
from hrp2_sim_bridge.settings import TICK

_BEARS = 0.05  # normal force above which a sole is on the floor, as a share of the weight
# Lengths are as of HRP-2's sole.
_FOREIGN = 0.05  # a reference's ZMP farther outside the soles is not caused by the floor [m]
_EXACT = 1e-6  # distance below which the soles can bear the wanted ZMP [m]

# Gains and bounds. They were chosen with a linear model: a body with the moment of inertia
# 1.2 m h^2 on the rubber of one foot or of both, in roll and pitch, with the delay of a tick and
# the smoothing. Every oscillating mode of this model has a damping ratio of at least 0.75 if the
# rubber is 30 % softer or stiffer or one gain differs by 30 % (0.5 if `_DAMPING` itself is 30 %
# lower), and of at least 0.4 with two more ticks of delay. While the robot walks, `_DCM_GAIN`
# makes it faster and less damped.
_FREQUENCY = 4.5  # natural frequency of the pendulum's closed loop [rad/s]
_DAMPING = 0.9  # damping ratio of the pendulum's closed loop
_INTEGRAL_TIME = 2.0  # time in which a constant tilt doubles its moment [s]
_FORCE_RATE = 24.0  # rate at which a missing force or moment is corrected [1/s]
_FORCE_MEMORY = 1.0  # time constant with which these corrections decay [s]
_SEARCH_SPEED = 0.05  # speed at which a foot that should have landed is lowered further [m/s]
_SMOOTHING = 0.01  # time constant of the feet's commands [s]
_RATE_SMOOTHING = 0.02  # time constant of the measured rate of the tilt [s]
_DCM_GAIN = 1.6  # additional shift of the ZMP by the error of the DCM while the robot walks
_DCM_TIME = 0.2  # time in which this feedback comes and goes when a walk begins and ends [s]
_SOFT_START = 0.2  # time after a reset in which the corrections reach their full size [s]
# Distance of the ZMP from a sole's middle, towards the other sole, at which this sole begins to
# bear the whole weight [m].
_INSET = 0.02
_EDGE = 0.002  # smallest distance of the ZMP from a sole's edge that the ankle moments keep [m]
_LARGEST_LIFT = 0.025  # largest correction of a foot's height [m]
_LARGEST_ANGLE = 0.15  # largest correction of a foot's roll or pitch [rad]


class Stabilizer:
    """Corrects the reference of the legs once in each control tick.

    Args:
        robot: Configuration of the robot, with the rubber that the stabilizer assumes.
    """

    def __init__(self, robot: SimulatedRobot) -> None:
        self._robot = robot
        self._model = ReferenceStanceModel(robot)
        self._drives = robot.drives
        self._yields = 1.0 / (self._drives.position_gain + self._drives.speed_gain / TICK)
        self._weight = robot.mass * GRAVITY
        rubber, stiffness = robot.sole_rubber, robot.sole_rubber.stiffness
        half = self._model.half_size
        self._stiffness = stiffness
        # Stiffness of a rigid sole on four springs at its corners against rotation about x and y.
        self._turn_stiffness = stiffness * half[::-1] ** 2
        scale = robot.sole_scale
        self._reach, self._inset = half - _EDGE * scale, _INSET * scale
        self._foreign = _FOREIGN * scale
        self._touchdown = Touchdown(_BEARS * self._weight)
        self._middles = self._model.middles.tolist()
        # Number of ticks by which the stabilizer looks ahead in the reference: a command is reached
        # one tick later and smoothed, but the rubber's damping responds early.
        early = rubber.damping / stiffness
        self._lead = max(1, 1 + round((_SMOOTHING - early) / TICK))
        angle = _LARGEST_ANGLE
        self._bound = np.array([_LARGEST_LIFT * scale, angle, angle])
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
        self._against: Array | None = None
        self._torque = np.zeros(count)
        self._servo = np.zeros(count)
        self._give = np.zeros(count)
        self._coming: deque[tuple[ReferenceStance, FootLoads]] = deque(maxlen=self._lead)

    def offsets(self, times: Array) -> Array:
        """Return joint corrections (T, J) [rad] at times (T,) [s] in the last update's tick."""
        share = ((times - self._begin) / TICK).clip(0.0, 1.0)[:, None]
        return np.asarray(self._before + share * (self._after - self._before))

    def update(
        self, sample: TickSample, reference: Callable[[float], JointReference],
        hands: Array | None = None,
    ) -> None:
        """Choose the correction for the end of the tick that begins now.

        It follows from what was measured by now, from the uncorrected reference at times [s], and
        from the load of the hands (6,) in base_link [N, N m]; None where that does not count.
        """
        now = sample.time
        if not self._coming:
            stance = self._model.at(reference(now))
            loads = self._share(stance.zmp, stance, stance.standing)
            self._coming.extend([(stance, loads)] * self._lead)
        here, due = self._coming[0]
        normal = np.array([sample.left_wrench[2], sample.right_wrench[2]])
        landing = self._touchdown.update(normal, due.force, here.heights, here.standing)
        change = TICK / _DCM_TIME * (1.0 if landing.walking else -1.0)
        self._walking = min(max(self._walking + change, 0.0), 1.0)
        tilt, rate = measured_tilt(sample, here)
        # Legs with gears that give tremble; an answer to each tremor would keep it alive.
        self._rate += TICK / (TICK + _RATE_SMOOTHING) * (rate - self._rate)
        self._make_up(sample, landing, landing.standing(here.standing), due)
        stance = self._model.at(reference(now + self._lead * TICK))
        standing = landing.standing(stance.standing)
        planned = self._share(stance.zmp, stance, standing)
        wanted = self._wanted_loads(stance, planned, standing, tilt, hands)
        self._coming.append((stance, wanted))
        feet = self._foot_commands(stance, wanted, tilt) + self._made_up
        self._carry(stance, planned, wanted)
        # Without the soft start the legs would stretch at once, and the robot would hop.
        self._eased = min(self._eased + TICK / _SOFT_START, 1.0)
        target = self._eased * feet.clip(-self._bound, self._bound)
        self._feet += (target - self._feet) * (TICK / (TICK + _SMOOTHING))
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
        hands: Array | None,
    ) -> FootLoads:
        """Compute loads that carry the reference and bring the body upright."""
        height = float(stance.com[2]) - stance.floor
        inertia = self._robot.mass * height**2
        gain = self._weight * height + inertia * _FREQUENCY**2
        rate_gain = 2.0 * _DAMPING * _FREQUENCY * inertia
        # A ZMP that the soles cannot bear has another cause: in the hit the door brakes the body.
        zmp = stance.zmp if planned.beyond < self._foreign else stance.com[:2]
        against = self._carry_hands(hands, stance, zmp, gain)
        moment = against - gain * (tilt + self._tilt_sum) - rate_gain * self._rate
        # The error of the DCM is that of the CoM and of its speed over the pendulum's frequency.
        dcm = height * (tilt + math.sqrt(height / GRAVITY) * self._rate)
        moment -= self._walking * _DCM_GAIN * self._weight * dcm
        shift = np.array([-moment[1], moment[0]]) / self._weight
        wanted = self._share(zmp + shift, stance, standing)
        if wanted.beyond < _EXACT:  # otherwise the soles can do no more, and a sum would wind up
            self._tilt_sum += tilt * (TICK / _INTEGRAL_TIME)
            self._tilt_sum = self._tilt_sum.clip(-_LARGEST_ANGLE, _LARGEST_ANGLE)
        return wanted

    def _carry_hands(
        self, hands: Array | None, stance: ReferenceStance, zmp: Array, gain: float
    ) -> Array:
        """Compute the floor's moment that carries the load of the hands, (2,) [N m].

        A horizontal force F at the height z over the floor moves the ZMP by F z / N (Murooka et
        al., "Humanoid loco-manipulations pattern generation and stabilization control", RA-L 2021).
        The sum of the tilt carries a load that was there before it counts, and the two change
        places without a jump.
        """
        before, against = self._against, np.zeros(2)
        if hands is not None:
            force = stance.level.dot(hands[:3])
            about = stance.level.dot(hands[3:]) - cross(np.array([*zmp, stance.floor]), force)
            against = -about[:2] * (self._weight / stance.normal_force)
        if (before is None) != (hands is None):
            self._tilt_sum = self._tilt_sum + (against if before is None else -before) / gain
        self._against = None if hands is None else against
        return against

    def _share(
        self, zmp: Array, stance: ReferenceStance, standing: Sequence[bool]
    ) -> FootLoads:
        return share_load(
            zmp, stance.normal_force, stance.centers, stance.turns[:, :2, :2], standing,
            self._reach, self._inset)

    def _foot_commands(self, stance: ReferenceStance, wanted: FootLoads, tilt: Array) -> Array:
        """Compute heights [m], rolls and pitches [rad] of the feet that load the rubber as wanted.

        They are in the axes of each sole, (2, 3).
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
        rate = _FORCE_RATE * TICK
        wrenches = (sample.left_wrench.tolist(), sample.right_wrench.tolist())
        self._made_up *= 1.0 - TICK / _FORCE_MEMORY
        for foot, (_, _, normal, roll, pitch, _) in enumerate(wrenches):
            if normal >= _BEARS * self._weight:
                x, y = self._middles[foot]
                about = np.array([roll - normal * y, pitch + normal * x])
                self._made_up[foot, 1:] += (
                    about - wanted.moment[foot]) * (rate / self._turn_stiffness)
        lower = np.array(landing.late) * (_SEARCH_SPEED * TICK)
        self._made_up[:, 0] += landing.descent - lower
        if all(standing):
            left, right = wanted.force.tolist()
            excess = wrenches[0][2] - left - (wrenches[1][2] - right)
            step = 0.5 * excess / self._stiffness * rate
            self._made_up[:, 0] += (step, -step)
        self._made_up = np.minimum(np.maximum(self._made_up, -self._bound), self._bound)

    def _carry(self, stance: ReferenceStance, planned: FootLoads, wanted: FootLoads) -> None:
        """Update the windup of gears and servos under the torques that carry the reference.

        A gear of stiffness k winds up by torque / k. A servo with the gains P and D on position
        and speed yields by an angle e with P e + D e' = torque.
        """
        if planned.beyond > self._foreign:
            return  # the floor does not cause this motion, so the joints bear other torques
        wrenches = np.empty((2, 6, 1))
        shares, forces = wanted.force / stance.normal_force, stance.sole_force.tolist()
        # Both soles turn the robot by what their forces at the soles' middles leave.
        (x, y), (fx, fy) = shares.dot(stance.centers).tolist(), stance.force.tolist()
        turn = stance.yaw_moment - (x * fy - y * fx)
        for foot, share in enumerate(shares.tolist()):
            (fx, fy, fz), (x, y) = forces[foot], self._middles[foot]
            roll, pitch = wanted.moment[foot].tolist()
            wrenches[foot, :, 0] = (
                share * fx, share * fy, share * fz,
                roll + share * y * fz, pitch - share * x * fz,
                share * (x * fy - y * fx + turn))
        torque = stance.effort.copy()
        torque[self._model.leg_joints] -= (stance.legs @ wrenches)[..., 0]
        smooth = TICK / (TICK + _SMOOTHING)
        self._torque += smooth * (torque - self._torque)
        drives = self._drives
        self._servo = self._yields * (self._torque + drives.speed_gain / TICK * self._servo)
        self._give = self._torque / drives.stiffness + self._servo

    def _joint_offsets(self, stance: ReferenceStance) -> Array:
        """Compute the joint corrections that move the feet as commanded, (J,) [rad]."""
        twist = np.zeros((2, 6, 1))
        for foot, (lift, roll, pitch) in enumerate(self._feet.tolist()):
            x, y = self._middles[foot]
            twist[foot, 2:5, 0] = lift - roll * y + pitch * x, roll, pitch
        offsets = np.zeros(len(self._robot.joint_names))
        offsets[self._model.leg_joints] = (stance.to_joints @ twist)[..., 0]
        return offsets


def measured_tilt(sample: TickSample, stance: ReferenceStance) -> tuple[Array, Array]:
    """Compute the tilt of the body from the IMU and from the stance of the reference at that time.

    Returns:
        Tilt about x and y of the level frame, (2,) [rad], and its rate, (2,) [rad/s].
    """
    x, y, z, w = sample.imu.orientation.tolist()
    a, b, c = stance.imu[2].tolist()  # the vertical in the IMU's axes, wanted and, below, measured
    d, e, f = 2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)
    tilt = stance.imu.dot(np.array([e * c - f * b, f * a - d * c, d * b - e * a]))
    rate = stance.imu.dot(sample.imu.angular_velocity - stance.imu_rate)
    return tilt[:2], rate[:2]
