"""HRP-2 as the planner needs it: a thin layer over Pinocchio.

Joint vectors are in the robot's own order (RLEG 0-5, LLEG 0-5, CHEST, HEAD, RARM, LARM). The base
is a free joint; in every planned motion its axes stay parallel to those of odom.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
from hrp2_description.robot import RobotConfig
from hrp2_description.support import sole_corners
from numpy.typing import ArrayLike, NDArray

from .chain import Chain
from .leg_ik import LegGeometry

if TYPE_CHECKING:
    from .clearance import BodyGeometry

Array = NDArray[np.float64]

SIDES = ("right", "left")
TOWARDS_DOOR = (0.0, -1.0, 0.0)


@dataclass(frozen=True)
class Foot:
    """A foot as the planner sees it.

    Attributes:
        frame: Name of the sole's frame.
        sole: Sole from the ankle centre, in the foot's axes, (3,) [m].
        rectangle: x_min, x_max, y_min, y_max of the support area in the sole's frame [m].
    """

    frame: str
    sole: Array
    rectangle: tuple[float, float, float, float]

    def corners(self, position: ArrayLike) -> Array:
        """Corners of the support area on the floor for a sole at a position, (4, 2) [m]."""
        x, y = np.asarray(position, dtype=float)[:2]
        return np.asarray(sole_corners(self.rectangle, (x, y, 0.0)))


class RobotModel:
    """Kinematics and dynamics of the robot.

    Not safe to share between threads: Pinocchio's work space is reused.
    """

    def __init__(self, config: RobotConfig) -> None:
        """Load the URDF that the robot's configuration names."""
        self.config = config
        self.model: Any = pin.buildModelFromUrdf(str(config.urdf_path), pin.JointModelFreeFlyer())
        self.data: Any = self.model.createData()
        self.joint_names: tuple[str, ...] = tuple(config.joint_names)
        ids = [self.model.getJointId(name) for name in self.joint_names]
        self.q_index = np.array([self.model.joints[i].idx_q for i in ids])
        self.v_index = np.array([self.model.joints[i].idx_v for i in ids])
        self.lower, self.upper = config.lower, config.upper
        self.speed_limit, self.effort_limit = config.velocity_limit, config.effort_limit
        self.mass = float(pin.computeTotalMass(self.model))
        self.legs = {side: self._leg(side) for side in SIDES}
        self.feet = {side: self._foot(side) for side in SIDES}
        self.leg_columns = {side: self._columns(f"{side[0].upper()}LEG_JOINT") for side in SIDES}
        self.arm_columns = {side: self._columns(f"{side[0].upper()}ARM_JOINT") for side in SIDES}
        self.leg_chains = {side: self._chain(self.feet[side].frame) for side in SIDES}
        self.hand_chain = self._chain(config.hand_link)
        contact = self.model.frames[self._frame_id(config.contact_link)]
        self._contact_joint = int(contact.parentJoint)
        self._contact_offset = np.array(contact.placement.translation)

    @cached_property
    def bodies(self) -> BodyGeometry:
        """Its collision shapes."""
        from .clearance import BodyGeometry  # which imports this module

        return BodyGeometry(self)

    # -- configuration ---------------------------------------------------------------------

    def configuration(self, base: ArrayLike, joints: ArrayLike) -> Array:
        """Pinocchio's q for an upright base at a position (3,) [m] and joints (30,) [rad]."""
        q = np.array(pin.neutral(self.model))
        q[:3] = base
        q[self.q_index] = joints
        return q

    def velocity(self, base: ArrayLike, joints: ArrayLike) -> Array:
        """Pinocchio's v (or a) for an upright base that does not turn."""
        v = np.zeros(self.model.nv)
        v[:3] = base
        v[self.v_index] = joints
        return v

    def indices(self, names: Sequence[str]) -> NDArray[np.int_]:
        """Columns of joints in the robot's order."""
        return np.array([self.joint_names.index(name) for name in names], dtype=int)

    # -- figures of one posture --------------------------------------------------------------

    def com(self, q: Array) -> Array:
        """Centre of mass in odom, (3,) [m]."""
        return np.array(pin.centerOfMass(self.model, self.data, q))

    def inertia_about_com(self, q: Array) -> Array:
        """Inertia of the stiffened robot about its CoM, axes of odom, (3, 3) [kg m^2]."""
        pin.ccrba(self.model, self.data, q, np.zeros(self.model.nv))
        return np.array(self.data.Ig.inertia)

    def contact_position(self, q: Array) -> Array:
        """Centre of the contact body (the elbow) in odom, (3,) [m]."""
        pin.forwardKinematics(self.model, self.data, q)
        return np.array(self.data.oMi[self._contact_joint].act(self._contact_offset))

    def frame_position(self, q: Array, name: str) -> Array:
        """Origin of a frame in odom, (3,) [m]."""
        pin.forwardKinematics(self.model, self.data, q)
        index = self._frame_id(name)
        return np.array(pin.updateFramePlacement(self.model, self.data, index).translation)

    def frame_pose(self, q: Array, name: str) -> tuple[Array, Array]:
        """Origin (3,) [m] and orientation (3, 3) of a frame in odom."""
        pin.forwardKinematics(self.model, self.data, q)
        pose = pin.updateFramePlacement(self.model, self.data, self._frame_id(name))
        return np.array(pose.translation), np.array(pose.rotation)

    def point_jacobian(self, q: Array, joint: int, offset: Array) -> Array:
        """Jacobian of a point fixed to a joint's body, axes of odom, (3, nv)."""
        pin.computeJointJacobians(self.model, self.data, q)
        j = pin.getJointJacobian(
            self.model, self.data, joint, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        )
        arm = self.data.oMi[joint].rotation @ offset
        return np.array(j[:3] - pin.skew(arm) @ j[3:])

    def contact_jacobian(self, q: Array) -> Array:
        """Jacobian of point B's body centre, axes of odom, (3, nv)."""
        return self.point_jacobian(q, self._contact_joint, self._contact_offset)

    def effective_mass(
        self,
        q: Array,
        *,
        locked: Sequence[str],
        feet: Sequence[str] = SIDES,
        direction: ArrayLike = TOWARDS_DOOR,
        rotors: float = 0.0,
    ) -> float:
        """Mass that point B shows to a blow, from the spatial dynamics of the whole robot.

        ``1 / (J_B (M^-1 - M^-1 Jc^T (Jc M^-1 Jc^T)^-1 Jc M^-1) J_B^T)`` with the feet fixed on
        the floor as constraints Jc. A blow is too short for the drives to answer, so joints that
        are not locked move freely. The right foot hit near its center of percussion and the left
        one off the line make this differ from eq. (3), which is a free body in a plane.

        Args:
            q: Configuration at the hit.
            locked: Joints that the brace holds.
            feet: Sides whose foot stays put, of ``right`` and ``left``; may be empty.
            direction: Normal of the contact in odom, (3,).
            rotors: Multiple of the rotors' inertia, gear^2 J, that is added to each joint.

        Returns:
            Effective mass [kg].
        """
        m = np.array(pin.crba(self.model, self.data, q))
        m = np.triu(m) + np.triu(m, 1).T
        m[self.v_index, self.v_index] += rotors * self.config.armature
        free = np.setdiff1d(np.arange(self.model.nv), self.v_index[self.indices(locked)])
        minv = np.linalg.inv(m[np.ix_(free, free)])
        n = np.asarray(direction, dtype=float)
        jb = ((n / np.linalg.norm(n)) @ self.contact_jacobian(q))[free]
        if feet:
            soles = [self.frame_jacobian(q, self.feet[side].frame) for side in feet]
            jc = np.vstack(soles)[:, free]
            mj = minv @ jc.T
            minv = minv - mj @ np.linalg.solve(jc @ mj, mj.T)
        return float(1.0 / (jb @ minv @ jb))

    def frame_jacobian(self, q: Array, name: str) -> Array:
        """Jacobian of a frame, axes of odom, linear rows first, (6, nv)."""
        return self.frames_at(q, [name])[0][1]

    def frames_at(self, q: Array, names: Sequence[str]) -> list[tuple[Array, Array]]:
        """Position in odom (3,) [m] and Jacobian (6, nv) of each of some frames."""
        pin.computeJointJacobians(self.model, self.data, q)
        found = []
        for name in names:
            index = self._frame_id(name)
            place = pin.updateFramePlacement(self.model, self.data, index).translation
            jacobian = pin.getFrameJacobian(
                self.model, self.data, index, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
            found.append((np.array(place), np.array(jacobian)))
        return found

    def hand_radius(self) -> float:
        """Radius of the sphere that is the right hand's collision shape [m]."""
        link = self.config.hand_link
        root = ElementTree.parse(self.config.urdf_path).getroot()
        sphere = root.find(f"./link[@name='{link}']/collision/geometry/sphere")
        if sphere is None:
            raise ValueError(f"the URDF gives {link!r} no collision sphere")
        return float(sphere.attrib["radius"])

    # -- reading the model --------------------------------------------------------------------

    def _frame_id(self, name: str) -> int:
        if not self.model.existFrame(name):
            raise ValueError(f"the URDF has no frame {name!r}")
        return int(self.model.getFrameId(name))

    def _chain(self, frame: str) -> Chain:
        self._frame_id(frame)
        return Chain(self.model, self.joint_names, frame)

    def _columns(self, prefix: str) -> NDArray[np.int_]:
        return np.array([i for i, n in enumerate(self.joint_names) if n.startswith(prefix)])

    def _leg(self, side: str) -> LegGeometry:
        offset = [
            np.array(self.model.jointPlacements[self.model.getJointId(name)].translation)
            for name in (f"{side[0].upper()}LEG_JOINT{i}" for i in range(6))
        ]
        shank = offset[4]
        flat = np.abs(np.concatenate([offset[1], offset[2], offset[3][:2], shank[:1], offset[5]]))
        if np.any(flat > 1e-9):
            raise ValueError(f"the {side} leg of the URDF is not of HRP-2's kind")
        return LegGeometry(
            name=f"{side} leg",
            hip=offset[0],
            thigh=float(-offset[3][2]),
            shank=float(-shank[2]),
            lateral=float(shank[1]),
        )

    def _foot(self, side: str) -> Foot:
        frame = self.config.feet[side].sole
        placement = self.model.frames[self._frame_id(frame)].placement
        return Foot(
            frame=frame,
            sole=np.array(placement.translation),
            rectangle=self.config.soles[side],
        )
