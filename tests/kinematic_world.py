"""Kinematics of a robot that follows its reference exactly, and of a door, without PyBullet.

The left sole is fixed to the floor. The door obeys eq. (1). When the elbow reaches the leaf, the
door receives the momentum of eq. (2) for a given effective mass and coefficient of restitution. The
joints keep their reference: the floor provides the impulse that the elbow transfers. Afterwards the
leaf lies against the hand.
"""

import math
from typing import Any

import numpy as np
import pinocchio as pin
from hrp2_description.robot import load_robot_config
from reference_door import ReferenceDoor
from scipy.interpolate import BPoly

STOP_TIME = 0.15     # duration of the braking after an empty trajectory [s]
HAND_RADIUS = 0.05   # radius of r_gripper's collision sphere [m]
LIFTED = 5e-4        # height above which a sole bears no load [m]


class Reference:
    """Joint reference that behaves like ros2_control's JointTrajectoryController."""

    def __init__(self, position: np.ndarray) -> None:
        self._levels: tuple[Any, ...] = ()
        self._span = (0.0, 0.0)
        self._rest = position

    def at(self, t: float) -> np.ndarray:
        """Return positions, velocities and accelerations at a time, (3, 30) [rad, s]."""
        if not self._levels or t >= self._span[1]:
            return np.array([self._rest, 0.0 * self._rest, 0.0 * self._rest])
        return np.array([level(max(t, self._span[0])) for level in self._levels])

    def follow(self, now: float, times: np.ndarray, rows: np.ndarray) -> None:
        """Continue from the present reference through points.

        Args:
            now: Current time [s].
            times: Times of the points, (K,) [s].
            rows: Positions and up to two derivatives of them, (K, D, 30).
        """
        points = [self.at(now)[:rows.shape[1]], *rows]
        spline = BPoly.from_derivatives([now, *times], points)
        self._levels = (spline, spline.derivative(), spline.derivative(2))
        self._span, self._rest = (now, float(times[-1])), rows[-1, 0]

    def stop(self, now: float) -> None:
        """Brake and hold; `now` is the current time [s]."""
        q, v, a = self.at(now)
        end = q + v * STOP_TIME / 2.0 + a * STOP_TIME**2 / 12.0
        self.follow(now, np.array([now + STOP_TIME]), np.array([[end, 0.0 * v, 0.0 * a]]))


class Body:
    """The robot with its left sole fixed to the floor; odom is midway between both soles."""

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
        """Return Pinocchio's configuration, and the poses of soles, elbow and hand in odom."""
        q = pin.neutral(self.model)
        q[self._index] = joints
        pin.framesForwardKinematics(self.model, self.data, q)
        frames = [self.data.oMf[i].copy() for i in self._frames]
        base = self._left * frames[0].inverse()
        q[:7] = pin.SE3ToXYZQUAT(base)
        return q, [base * frame for frame in frames]

    def motion(self, reference: Reference, t: float, h: float = 0.005) -> tuple[Any, ...]:
        """Return configuration, velocity and acceleration by differences, and the soles' poses."""
        before, (here, frames), after = (
            self.place(reference.at(t - h)[0])[0], self.place(reference.at(t)[0]),
            self.place(reference.at(t + h)[0])[0])
        one = pin.difference(self.model, before, here) / h
        two = pin.difference(self.model, here, after) / h
        return here, (one + two) / 2.0, (two - one) / h, frames[:2]

    def sole_wrenches(self, q: Any, v: Any, a: Any, soles: list[Any]) -> list[Any]:
        """Return the wrenches of the floor on the left and the right sole, in the soles' frames.

        Their sum follows from the dynamics of the whole body. The forces are distributed so that
        the ZMP would lie on the line between the soles; then both are shifted to the ZMP.
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
    """The door, and its contacts with elbow and hand.

    Args:
        door: Dynamics of the door.
        hinge: x and y of the hinge in odom, (2,) [m].
        width: Width of the leaf [m].
        mass: Effective mass at the elbow [kg].
        restitution: Coefficient of restitution of a hit of the elbow.

    Attributes:
        angle: Opening angle [rad].
        speed: Angular velocity, positive when the door opens [rad/s].
        impulse: Sum of the impulses of all hits of the elbow, along the leaf's normal [N s].
    """

    def __init__(self, door: ReferenceDoor, hinge: np.ndarray, width: float, mass: float,
                 restitution: float) -> None:
        self._door, self._hinge, self._width = door, hinge, width
        self._mass, self._restitution = mass, restitution
        self.angle, self.speed, self.impulse = 0.0, 0.0, 0.0
        self._touch: dict[str, float] = {}
        self._struck = False

    def _least_angle(self, centre: np.ndarray, radius: float) -> tuple[float, float]:
        """Return the angle of a leaf that a sphere touches [rad], and its lever arm [m]."""
        x, y = centre[:2] - self._hinge
        away = math.hypot(x, y)
        along = math.sqrt(max(away**2 - radius**2, 0.0))
        if x <= 0.0 or along > self._width:
            return -math.pi, along
        return math.atan2(-y, x) + math.asin(radius / away), along

    def step(self, dt: float, torque: float, elbow: tuple[Any, float],
             hand: tuple[Any, float]) -> None:
        """Advance by a step.

        Args:
            dt: Length of the step [s].
            torque: Torque of a person about the hinge [N m].
            elbow: Centre (3,) and radius of the elbow's sphere in odom [m].
            hand: Centre (3,) and radius of the hand's sphere in odom [m].
        """
        slope = self._door.acceleration(self.angle, self.speed, torque)
        middle = self.angle + 0.5 * dt * self.speed, self.speed + 0.5 * dt * slope
        self.speed += dt * self._door.acceleration(*middle, torque)
        self.angle += dt * middle[1]
        touch, l_b = self._least_angle(*elbow)
        closing = (touch - self._touch.get("elbow", touch)) / dt - self.speed
        # Eq. (2), with v_rB - v_door = closing l_B, once for each contact: it represents the whole
        # contact of about 15 ms, in which the reference of a robot slows down.
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
