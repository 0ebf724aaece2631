"""A robot and a door without a physics engine: the kinematic double of a driver.

A stock controller (controller_double.py) moves the joints exactly, and the left sole is fixed to
the floor. The door obeys eq. (1). When the elbow reaches the leaf, the door receives the momentum
of eq. (2) for a given effective mass and coefficient of restitution; the floor provides the impulse
that the elbow transfers. Afterwards the leaf lies against the hand.
"""

import math
from typing import Any

import numpy as np
import pinocchio as pin
from controller_double import ControllerDouble
from door_impact_common.constants import GRAVITY
from door_impact_common.errors import DoorImpactError
from hrp2_description.robot import load_robot_config
from humanoid_motion.driver_interface import Driver, TickSample, TrajectoryArrays
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.samples import ImuSample
from reference_door import ReferenceDoor
from robot_driver.trajectory_checks import JointLimits

TICK = 0.005    # period of the measurements [s]
SAMPLE = 0.001  # period of the door's encoder [s]
COUNTS_PER_TURN, COUNTER = 14400, 2**16
CLOSED_COUNT = 65500  # count at the closed door
UPWARDS = np.array([0.0, 0.0, GRAVITY])  # reading of an accelerometer at rest, in the world [m/s^2]
HAND_RADIUS = 0.05   # radius of r_gripper's collision sphere [m]
LIFTED = 5e-4        # height above which a sole bears no load [m]


class RefusedError(DoorImpactError):
    """The controller has refused a trajectory."""


class KinematicRobot(Driver):
    """A robot whose joints follow their controller exactly, and the door that it hits.

    Args:
        leaf: The door.
    """

    def __init__(self, leaf: "Leaf") -> None:
        self.leaf = leaf
        self.config = load_robot_config()
        self._model = RobotModel(self.config)
        links = ("l_sole", "r_sole", self.config.contact_link, self.config.hand_link)
        self._frames = [self._model.model.getFrameId(name) for name in links]
        self._left = pin.SE3.Identity()  # of the left sole in odom, which is midway between both
        left, right = self._place(self.config.half_sitting)[1][:2]
        self._left = pin.SE3(np.eye(3), (left.translation - right.translation) / 2.0)
        self._controller = ControllerDouble(JointLimits.of(self.config), self.config.half_sitting)
        self._steps = 0
        self._push = (0.0, 0.0, 1.0)  # impulse [N m s], start and duration [s]

    @property
    def time(self) -> float:
        """Time since the start [s]."""
        return self._steps * SAMPLE

    def push_door(self, impulse: float, duration: float) -> None:
        """Push the door by hand, beginning now: the torque is half a sine [N m s, s]."""
        self._push = (impulse, self.time, duration)

    def follow(self, trajectory: TrajectoryArrays, stamp: float) -> None:
        """Let the controller take a trajectory, or raise `RefusedError` with its words."""
        known = len(self._controller.rejected)
        self._controller.accept(trajectory, stamp, self.time)
        for words in self._controller.rejected[known:]:
            raise RefusedError(words)

    def stop(self) -> None:
        """Hold still."""
        self._controller.stop(self.time)

    def step(self) -> TickSample:
        """Advance by a tick of 5 ms; return what was measured by its end."""
        before = self.leaf.impulse
        self._controller.positions(np.array([self.time]))
        counts = tuple(self._step() for _ in range(round(TICK / SAMPLE)))
        # The base's velocity and acceleration are differences.
        (q0, _), (q, frames), (q1, _) = (
            self._place(self._controller.sample(self.time + off).position)
            for off in (-TICK, 0.0, TICK))
        one = pin.difference(self._model.model, q0, q) / TICK
        two = pin.difference(self._model.model, q, q1) / TICK
        v, a = (one + two) / 2.0, (two - one) / TICK
        left, right = self._sole_wrenches(q, v, a, frames[:2])
        # The robot continues in a hit, so the floor gives the robot at once what the robot gives
        # the door. The soles' moments of the hit are left out.
        for wrench in (left, right):
            wrench[1] -= (self.leaf.impulse - before) / TICK / 2.0  # towards the door
        up = pin.XYZQUATToSE3(q[:7]).rotation.T @ UPWARDS
        imu = ImuSample(q[3:7], v[3:6], a[:3] + np.cross(v[3:6], v[:3]) + up)
        now = self._controller.sample(self.time)
        unknown = np.full(len(now.position), math.nan)
        return TickSample(self.time, now.position, now.velocity, unknown, left, right, imu, counts)

    def _step(self) -> int:
        """Advance by a millisecond; return the count of the door's encoder."""
        self._steps += 1
        impulse, start, length = self._push
        x = (self.time - start) / length
        torque = impulse * math.pi / (2.0 * length) * math.sin(math.pi * x) if x < 1.0 else 0.0
        frames = self._place(self._controller.sample(self.time).position)[1]
        self.leaf.step(SAMPLE, torque, (frames[2].translation, self.config.contact_radius),
                       (frames[3].translation, HAND_RADIUS))
        turn = self.leaf.angle / (2.0 * math.pi)
        return (CLOSED_COUNT + round(turn * COUNTS_PER_TURN)) % COUNTER

    def _place(self, joints: np.ndarray) -> tuple[np.ndarray, list[Any]]:
        """Return Pinocchio's configuration, and the poses of soles, elbow and hand in odom."""
        model, data = self._model.model, self._model.data
        q = self._model.configuration(np.zeros(3), joints)
        pin.framesForwardKinematics(model, data, q)
        frames = [data.oMf[i].copy() for i in self._frames]
        base = self._left * frames[0].inverse()
        q[:7] = pin.SE3ToXYZQUAT(base)
        return q, [base * frame for frame in frames]

    def _sole_wrenches(self, q: Any, v: Any, a: Any, soles: list[Any]) -> list[np.ndarray]:
        """Return the wrenches of the floor on the left and the right sole, in the soles' frames.

        Their sum follows from the dynamics of the whole body. The forces are distributed so that
        the ZMP would lie on the line between the soles; then both are shifted to the ZMP.
        """
        torque = pin.rnea(self._model.model, self._model.data, q, v, a)
        total = pin.XYZQUATToSE3(q[:7]).act(pin.Force(torque[:6]))
        push, moment = total.linear, total.angular
        zmp = np.array([-moment[1], moment[0]]) / push[2]
        left, right = (sole.translation[:2] for sole in soles)
        line = left - right
        share = float(np.clip((zmp - right) @ line / (line @ line), 0.0, 1.0))
        if soles[1].translation[2] > LIFTED:
            share = 1.0
        shift = zmp - share * left - (1.0 - share) * right
        wrenches = []
        for sole, part in zip(soles, (share, 1.0 - share), strict=True):
            point = np.append(sole.translation[:2] + shift, 0.0)
            wrench = sole.actInv(pin.Force(part * push, np.cross(point, part * push)))
            wrenches.append(np.concatenate([wrench.linear, wrench.angular]))
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
        """Advance by a time [s] with the torque of a person [N m].

        Elbow and hand are spheres: centre in odom, (3,) [m], and radius [m].
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
