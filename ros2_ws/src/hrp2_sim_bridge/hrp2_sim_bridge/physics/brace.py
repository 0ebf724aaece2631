"""The brace: the contact through which the hitting arm leans on the trunk.

Both pads belong to the same robot, so their force on each other acts like torques of the joints
between them. They are computed here and added to the gears' torques, in the same way for every
physics engine: with the Jacobian J of the arm's pad relative to the trunk's, a force f on the arm
is the torques J^T f.
"""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from hrp2_description.drives_and_pads import Brace
from hrp2_description.errors import RobotConfigError
from hrp2_description.robot import RobotConfig
from humanoid_motion.pads import TANGENTIAL, normal_and_tangents
from humanoid_motion.pinocchio_model import free_floating_model, joint_columns

_NEAR = 0.01  # distance of the pads' surfaces below which their contact is computed [m]
# Spring k and damper c at a mass m are stable over steps h up to k h^2 + 2 c h = 4 m.
_STABLE = 2.0
_IMMOBILE = 1e-9  # smallest inverse mass of the pads [1/kg]


class BracePads:
    """Spring-damper with friction between the pad of the arm and the pad of the trunk.

    The normal force cannot pull. Friction is a spring that slides where its force would exceed
    the coefficient of friction times the normal force.

    Args:
        robot: Configuration of the robot.
        brace: Pads of the robot.
        scale: Factor of the pads' stiffness and damping.

    Attributes:
        clearance: Distance by which the pads are too far from each other for a contact to be
            computed [m]; 0 where they are near.
        jacobian: Jacobian of the arm's pad relative to the trunk's, along the normal and the two
            tangents, by the joints, (3, J); valid while the clearance is 0.
        force: Force on the arm's pad: along the normal of the trunk's pad, which is positive, and
            along its two tangents, (3,) [N].
        peak: Largest normal force since `clear` [N].
        impulse: Impulses of the torques on the joints since `clear`, (J,) [N m s].
    """

    def __init__(self, robot: RobotConfig, brace: Brace, scale: float = 1.0) -> None:
        self._model = free_floating_model(robot)
        self._data = self._model.createData()
        self._q_index, self._v_index = joint_columns(self._model, robot.joint_names)
        for pad in (brace.arm, brace.trunk):
            if not self._model.existFrame(pad.link):
                raise RobotConfigError(
                    "a pad of the brace", value=pad.link, limit="a link of the URDF")
        self._frames = [self._model.getFrameId(pad.link) for pad in (brace.arm, brace.trunk)]
        self._places = [np.array(pad.place) for pad in (brace.arm, brace.trunk)]
        self._ball, self._disc = brace.arm.size, brace.trunk.size
        self._axes = normal_and_tangents(np.array(brace.normal))
        share = np.array([1.0, TANGENTIAL, TANGENTIAL])
        self._wanted = scale * brace.stiffness * share, scale * brace.damping * share
        self._stiffness, self._damping = self._wanted
        self._friction = brace.friction
        self._q = pin.neutral(self._model)
        self.force = np.zeros(3)
        self._slid = np.zeros(2)
        self._touching = False
        self.clearance = math.inf
        self.jacobian = np.zeros((3, len(self._v_index)))
        self.clear()

    def clear(self) -> None:
        """Begin to measure the largest force and the impulse anew."""
        self.peak = 0.0
        self.impulse = np.zeros(len(self._v_index))

    def linearize(self, position: Array) -> None:
        """Compute place and Jacobian of the arm's pad at joint positions (J,) [rad].

        `torque` extrapolates from there, so this is called again after a millisecond.
        """
        model, data = self._model, self._data
        self._q[self._q_index] = position
        pin.forwardKinematics(model, data, self._q)
        arm, trunk = (pin.updateFramePlacement(model, data, frame) for frame in self._frames)
        places = [pose.act(place)
                  for pose, place in zip((arm, trunk), self._places, strict=True)]
        axes = self._axes.dot(trunk.rotation.T)
        offset = axes.dot(places[0] - places[1])
        above, *aside = offset.tolist()
        self.clearance = max(
            abs(above - self._ball) - _NEAR, math.hypot(*aside) - self._disc, 0.0)
        if self.clearance > 0.0:
            self.force, self._touching = np.zeros(3), False
            return
        pin.computeJointJacobians(model, data)
        # Both Jacobians are those of the point where the ball touches.
        point = places[0] - self._ball * axes[0]
        jacobians = []
        for frame, pose in zip(self._frames, (arm, trunk), strict=True):
            twist = pin.getFrameJacobian(
                model, data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
            jacobians.append(twist[:3] - pin.skew(point - pose.translation).dot(twist[3:]))
        jacobian = axes.dot(jacobians[0] - jacobians[1])
        self.jacobian = np.ascontiguousarray(jacobian[:, self._v_index])
        self._offset = offset - np.array([self._ball, 0.0, 0.0]) - self.jacobian.dot(position)

    def soften(self, step: float, inertia: Array) -> None:
        """Make the pads as stiff as wanted, or as physics steps [s] can follow.

        That depends on the least inertia that each joint can show, (J,) [kg m^2].
        """
        stiffness, damping = self._wanted
        mass = 1.0 / max(float((self.jacobian[0] ** 2).dot(1.0 / inertia)), _IMMOBILE)
        heaviest = step * (step * stiffness[0] + 2.0 * damping[0])
        share = min(1.0, _STABLE * mass / heaviest)
        self._stiffness, self._damping = share * stiffness, share * damping

    def torque(self, position: Array, speed: Array, step: float) -> Array | float:
        """Return the torques on the joints, (J,) [N m], for a step [s]; 0 without contact."""
        if self.clearance > 0.0:
            return 0.0
        place = self._offset + self.jacobian.dot(position)  # half the time of @
        if place[0] >= 0.0:
            self.force, self._touching = np.zeros(3), False
            return 0.0
        if not self._touching:
            self._slid, self._touching = place[1:].copy(), True
        place[1:] -= self._slid
        force = -self._stiffness * place - self._damping * self.jacobian.dot(speed)
        force[0] = max(force[0], 0.0)
        most, along = self._friction * force[0], math.hypot(force[1], force[2])
        if along > most:
            # The pads slide: the spring keeps only what friction can hold.
            force[1:] *= most / along
            self._slid += place[1:] + force[1:] / self._stiffness[1:]
        self.force = force
        self.peak = max(self.peak, float(force[0]))
        torque = force.dot(self.jacobian)
        self.impulse += step * torque
        return np.asarray(torque)
