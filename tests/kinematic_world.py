"""A robot that follows its reference exactly, and a door that it hits: no PyBullet.

The left sole is fixed to the floor. The door obeys eq. (1); where the elbow reaches it, it takes
the momentum of eq. (2) for a given effective mass and coefficient of restitution, while the joints
keep to their reference: what the elbow gives, the floor gives the feet. Later the leaf lies against
the hand.
"""

import math
from typing import Any

import numpy as np
import pinocchio as pin
from hrp2_description.robot import load_robot_config
from reference_door import ReferenceDoor
from scipy.interpolate import BPoly

STOP_TIME = 0.15     # [s] of braking after an empty trajectory
HAND_RADIUS = 0.05   # [m], of r_gripper's collision sphere
LIFTED = 5e-4        # [m], a sole higher than this bears nothing


class Reference:
    """Joint reference in the manner of ros2_control's JointTrajectoryController."""

    def __init__(self, position: np.ndarray) -> None:
        self._levels: tuple[Any, ...] = ()
        self._span = (0.0, 0.0)
        self._rest = position

    def at(self, t: float) -> np.ndarray:
        """Position, speed and acceleration at a time, (3, 30)."""
        if not self._levels or t >= self._span[1]:
            return np.array([self._rest, 0.0 * self._rest, 0.0 * self._rest])
        return np.array([level(max(t, self._span[0])) for level in self._levels])

    def follow(self, now: float, times: np.ndarray, rows: np.ndarray) -> None:
        """On from here to points (K,) with 1 to 3 derivatives each, (K, D, 30)."""
        points = [self.at(now)[:rows.shape[1]], *rows]
        spline = BPoly.from_derivatives([now, *times], points)
        self._levels = (spline, spline.derivative(), spline.derivative(2))
        self._span, self._rest = (now, float(times[-1])), rows[-1, 0]

    def stop(self, now: float) -> None:
        """Brakes and holds."""
        q, v, a = self.at(now)
        end = q + v * STOP_TIME / 2.0 + a * STOP_TIME**2 / 12.0
        self.follow(now, np.array([now + STOP_TIME]), np.array([[end, 0.0 * v, 0.0 * a]]))


class Body:
    """The robot with its left sole fixed where it stood at first; odom is midway between both."""

    def __init__(self) -> None:
        self.config = load_robot_config()
        self.model = pin.buildModelFromUrdf(str(self.config.urdf_path), pin.JointModelFreeFlyer())
        self.data = self.model.createData()
        joints = [self.model.getJointId(name) for name in self.config.joint_names]
        self._index = [self.model.joints[joint].idx_q for joint in joints]
        links = ("l_sole", "r_sole", self.config.contact_link, self.config.hand_link)
        self._frames = [self.model.getFrameId(name) for name in links]
        self._left = pin.SE3.Identity()
        left, right = self.place(self.config.half_sitting)[1][:2]
        middle = (left.translation + right.translation) / 2.0
        self._left = pin.SE3(np.eye(3), left.translation - middle)

    def place(self, joints: np.ndarray) -> tuple[np.ndarray, list[Any]]:
        """Configuration, and soles, elbow and hand in odom."""
        q = pin.neutral(self.model)
        q[self._index] = joints
        pin.framesForwardKinematics(self.model, self.data, q)
        frames = [self.data.oMf[i].copy() for i in self._frames]
        base = self._left * frames[0].inverse()
        q[:7] = pin.SE3ToXYZQUAT(base)
        return q, [base * frame for frame in frames]

    def motion(self, reference: Reference, t: float, h: float = 0.005) -> tuple[Any, ...]:
        """Configuration, velocity, acceleration (differences of the reference) and soles."""
        before, (here, frames), after = (
            self.place(reference.at(t - h)[0])[0], self.place(reference.at(t)[0]),
            self.place(reference.at(t + h)[0])[0])
        one = pin.difference(self.model, before, here) / h
        two = pin.difference(self.model, here, after) / h
        return here, (one + two) / 2.0, (two - one) / h, frames[:2]

    def sole_wrenches(self, q: Any, v: Any, a: Any, soles: list[Any]) -> list[Any]:
        """Of the floor on the left and the right sole, in their frames: the whole body's dynamics.

        They are shared so that the ZMP lies on the line between the soles, then shifted with it.
        """
        torque = pin.rnea(self.model, self.data, q, v, a)
        total = pin.XYZQUATToSE3(q[:7]).act(pin.Force(torque[:6]))
        push, moment = total.linear, total.angular
        zmp = np.array([-moment[1], moment[0]]) / push[2]
        left, right = (sole.translation[:2] for sole in soles)
        share = float(np.clip((zmp - right) @ (left - right) / ((left - right) @ (left - right)),
                              0.0, 1.0))
        if soles[1].translation[2] > LIFTED:
            share = 1.0
        shift = zmp - share * left - (1.0 - share) * right
        wrenches = []
        for sole, part in zip(soles, (share, 1.0 - share), strict=True):
            point = np.append(sole.translation[:2] + shift, 0.0)
            wrenches.append(sole.actInv(pin.Force(part * push, np.cross(point, part * push))))
        return wrenches


class Leaf:
    """The door and what touches it.

    Attributes:
        impulse: Of all hits of the elbow so far, along the leaf's normal [N s].
    """

    def __init__(self, door: ReferenceDoor, hinge: np.ndarray, width: float, mass: float,
                 restitution: float) -> None:
        self._door, self._hinge, self._width = door, hinge, width
        self._mass, self._restitution = mass, restitution
        self.angle, self.speed, self.impulse = 0.0, 0.0, 0.0
        self._touch: dict[str, float] = {}
        self._struck = False

    def _least_angle(self, centre: np.ndarray, radius: float) -> tuple[float, float]:
        """Of a leaf that a sphere touches [rad], and how far from the hinge [m]."""
        x, y = centre[:2] - self._hinge
        away = math.hypot(x, y)
        along = math.sqrt(max(away**2 - radius**2, 0.0))
        if x <= 0.0 or along > self._width:
            return -math.pi, along
        return math.atan2(-y, x) + math.asin(radius / away), along

    def step(self, dt: float, torque: float, elbow: tuple[Any, float],
             hand: tuple[Any, float]) -> None:
        """Moves on by dt [s].

        Args:
            torque: Of a person, about the hinge [N m].
            elbow, hand: Centre (3,) and radius [m] of the spheres that touch the leaf.
        """
        slope = self._door.acceleration(self.angle, self.speed, torque)
        middle = self.angle + 0.5 * dt * self.speed, self.speed + 0.5 * dt * slope
        self.speed += dt * self._door.acceleration(*middle, torque)
        self.angle += dt * middle[1]
        touch, l_b = self._least_angle(*elbow)
        closing = (touch - self._touch.get("elbow", touch)) / dt - self.speed
        # Eq. (2), with v_rB - v_door = closing l_B, once a touch: it stands for the whole contact,
        # some 15 ms in which a robot's reference slows down.
        if self.angle > touch:
            self._struck = False
        elif not self._struck and closing > 0.0:
            self._struck = True
            m = self._mass
            gained = (m * (1.0 + self._restitution) * closing * l_b**2
                      / (self._door.i_a + m * l_b**2))
            self.speed += gained
            self.impulse += self._door.i_a * gained / l_b
        push, _ = self._least_angle(*hand)
        if self.angle < push:
            self.speed = max(self.speed, (push - self._touch.get("hand", push)) / dt)
        self._touch = {"elbow": touch, "hand": push}
        self.angle = max(self.angle, push, 0.0)
        if self.angle == 0.0:
            self.speed = max(self.speed, 0.0)
