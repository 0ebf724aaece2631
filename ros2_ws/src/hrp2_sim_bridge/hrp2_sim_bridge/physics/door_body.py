"""The swing door in the simulator: a leaf on a hinge, its closer, its stop and its surface."""

from __future__ import annotations

import math
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from door_impact_common.errors import SettingError
from door_model.door.config import DoorConfig

from hrp2_sim_bridge.physics.contact import ContactDesign

_FRICTION = 0.3  # of the leaf's surface
_TABLE_STEP = 5e-4  # of the closer's tabulated torque [rad]
_BELOW_CLOSED = 0.05  # range of the table under the closed door [rad]
_WIDEST = 2.0  # opening at which the door meets its outer stop, if the linkage lets it [rad]
_STOP_STIFFNESS = 1.5e6  # of the frame [N m/rad]: 18 N m push the leaf in by 0.0007 deg
_STOP_DAMPING_RATIO = 1.5
_PUSH_IMPULSE = 200.0  # of a hand, with a margin [N m s]
_PUSH_DURATION = (0.001, 10.0)  # [s]
HINGE = 0


class DoorState(NamedTuple):
    """Angle [rad] and angular velocity [rad/s] of the leaf, positive when it opens."""

    angle: float
    velocity: float


class CloserTorque:
    """The closer's torque about the hinge, eqs. (12) and (13), from fine tables.

    Args:
        config: the door.
        widest: largest angle ever asked [rad].
    """

    def __init__(self, config: DoorConfig, widest: float) -> None:
        lowest = max(-_BELOW_CLOSED, config.linkage.closing_limit() + 1e-3)
        angles = np.arange(lowest, widest + _TABLE_STEP, _TABLE_STEP)
        f, eta = config.linkage.f_and_eta(angles)
        self._lowest = lowest
        self._last = len(angles) - 2
        self._spring = (eta * (config.k_c * f + config.tau_c0_prime)).tolist()
        door = config.door()
        self._opening, self._closing = (
            (door.viscosity(angles, sign) * eta**2).tolist() for sign in (1.0, -1.0)
        )

    def __call__(self, angle: float, velocity: float) -> float:
        """Torque on the leaf [N m], negative when it closes the door."""
        place = (angle - self._lowest) / _TABLE_STEP
        index = min(max(int(place), 0), self._last)
        share = min(max(place - index, 0.0), 1.0)
        spring = self._spring[index] * (1.0 - share) + self._spring[index + 1] * share
        table = self._opening if velocity > 0.0 else self._closing
        damping = table[index] * (1.0 - share) + table[index + 1] * share
        return -spring - damping * velocity


class DoorBody:
    """The leaf, its face towards the robot in the plane y = -door_distance when closed.

    Opening turns it about -z, its free edge to -y.

    Args:
        client: of PyBullet.
        config: the door.
        door_distance: from the world's origin to the leaf's face [m].
        hinge_x: place of the hinge [m].
        contact: surface of the leaf.
    """

    def __init__(
        self,
        client: Any,
        config: DoorConfig,
        door_distance: float,
        hinge_x: float,
        contact: ContactDesign,
    ) -> None:
        self._client = client
        self.config = config
        self.body = _create_leaf(client, config, door_distance, hinge_x)
        client.changeDynamics(
            self.body, HINGE,
            # The inertial frame is at the hinge, so this is the inertia about it.
            localInertiaDiagonal=[config.i_a] * 3,
            linearDamping=0.0, angularDamping=0.0, jointDamping=0.0,
            lateralFriction=_FRICTION, restitution=0.0,
            contactStiffness=contact.stiffness, contactDamping=contact.damping,
        )
        client.setJointMotorControl2(self.body, HINGE, client.VELOCITY_CONTROL, force=0.0)
        self._turn = partial(
            client.setJointMotorControl2, self.body, HINGE, client.TORQUE_CONTROL
        )
        self.widest = min(_WIDEST, config.linkage.opening_limit() - 0.05)
        self._closer = CloserTorque(config, self.widest + 0.04)
        self._stop_damping = 2.0 * _STOP_DAMPING_RATIO * math.sqrt(_STOP_STIFFNESS * config.i_a)
        self._pushes: list[tuple[float, float, float]] = []

    def state(self) -> DoorState:
        """Angle and angular velocity."""
        return DoorState(*self._client.getJointState(self.body, HINGE)[:2])

    def push(self, impulse: float, duration: float, now: float) -> None:
        """Push as a hand does: a half sine of torque.

        Args:
            impulse: angular impulse about the hinge [N m s], positive opens.
            duration: [s].
            now: when it begins [s].

        Raises:
            SettingError: more than a hand can do, or no number.
        """
        shortest, longest = _PUSH_DURATION
        if not shortest <= duration <= longest:
            raise SettingError("duration", duration, f"from {shortest:g} to {longest:g} s")
        if not abs(impulse) <= _PUSH_IMPULSE:
            raise SettingError("impulse", impulse, f"at most {_PUSH_IMPULSE:g} N m s")
        self._pushes.append((now, duration, impulse))

    def torque(self, state: DoorState, now: float, duration: float) -> float:
        """Torque of closer, friction, stops and pushes on the leaf [N m].

        Args:
            state: of the leaf.
            now: when the torque begins to act [s].
            duration: for how long it does [s].
        """
        # In the middle of the time: a torque that lags takes damping away from the closer.
        angle = state.angle + 0.5 * duration * state.velocity
        torque = self._closer(angle, state.velocity) + self._hand(now + 0.5 * duration)
        if self.config.friction:
            # At most what brings the leaf to rest.
            stopping = torque + self.config.i_a * state.velocity / duration
            torque -= min(max(stopping, -self.config.friction), self.config.friction)
        return torque + self._stops(state, torque, duration)

    def turn(self, torque: float) -> None:
        """Apply a torque [N m] in the coming physics step."""
        self._turn(force=torque)

    def _hand(self, time: float) -> float:
        if not self._pushes:
            return 0.0
        torque = 0.0
        for begin, duration, impulse in self._pushes:
            share = (time - begin) / duration
            if 0.0 <= share <= 1.0:
                torque += impulse * math.pi / (2.0 * duration) * math.sin(math.pi * share)
        if time > self._pushes[0][0] + self._pushes[0][1]:
            self._pushes.pop(0)
        return torque

    def _stops(self, state: DoorState, torque: float, step: float) -> float:
        """Torque of the frame (closed) or of the outer stop: a spring-damper that cannot pull.

        Taken implicitly, so that it stays stable at any step:
        tau = -(k (e + h w') + c w'), w' = w + h (tau + other) / I.
        """
        for edge, side in ((0.0, 1.0), (self.widest, -1.0)):
            inside = (edge - state.angle) * side
            if inside > 0.0:
                free = (state.velocity + step * torque / self.config.i_a) * side
                gain = step * _STOP_STIFFNESS + self._stop_damping
                push = _STOP_STIFFNESS * inside - gain * free
                return side * max(push, 0.0) / (1.0 + gain * step / self.config.i_a)
        return 0.0


def _create_leaf(client: Any, config: DoorConfig, door_distance: float, hinge_x: float) -> int:
    leaf = config.leaf
    half = [leaf.width / 2.0, leaf.thickness / 2.0, leaf.height / 2.0]
    centre = leaf.center()
    box = client.createCollisionShape(
        client.GEOM_BOX, halfExtents=half, collisionFramePosition=centre
    )
    picture = client.createVisualShape(
        client.GEOM_BOX, halfExtents=half, visualFramePosition=centre,
        rgbaColor=[0.72, 0.53, 0.35, 1.0],
    )
    return int(
        client.createMultiBody(
            baseMass=0.0,
            basePosition=[hinge_x, -door_distance, 0.0],
            linkMasses=[leaf.mass],
            linkCollisionShapeIndices=[box],
            linkVisualShapeIndices=[picture],
            linkPositions=[[0.0, 0.0, 0.0]],
            linkOrientations=[[0.0, 0.0, 0.0, 1.0]],
            linkInertialFramePositions=[[0.0, 0.0, 0.0]],
            linkInertialFrameOrientations=[[0.0, 0.0, 0.0, 1.0]],
            linkParentIndices=[0],
            linkJointTypes=[client.JOINT_REVOLUTE],
            linkJointAxis=[[0.0, 0.0, -1.0]],
        )
    )
