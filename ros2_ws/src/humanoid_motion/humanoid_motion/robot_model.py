"""A humanoid as the planner needs it: a thin layer over Pinocchio.

Joint vectors are in the robot's own order, `RobotConfig.joint_names`; (J,) is one entry a joint.
Joints of the URDF that are not among them are fixed at zero. The base is a free joint; in every
planned motion its axes stay parallel to those of odom.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from hrp2_description.errors import RobotConfigError
from hrp2_description.robot import SIDES, RobotConfig
from hrp2_description.support import sole_corners
from numpy.typing import ArrayLike, NDArray

from humanoid_motion.chain import Chain
from humanoid_motion.leg_ik import LegGeometry
from humanoid_motion.pinocchio_model import free_floating_model

TOWARDS_DOOR = (0.0, -1.0, 0.0)
_BELOW = "yz"
# Joints of a leg that `leg_ik` solves, and along which axes each may stand off the one before: the
# hip's axes meet in a point, so do the ankle's, and knee and ankle lie below hip and knee.
_LEG_KIND = (
    ("hip yaw", "RZ", "xyz"), ("hip roll", "RX", ""), ("hip pitch", "RY", ""),
    ("knee", "RY", _BELOW), ("ankle pitch", "RY", _BELOW), ("ankle roll", "RX", ""),
)  # fmt: skip
_PARALLEL = 1e-6  # of offsets [m] and of the entries of a rotation
_LEVEL = 1e-4  # of the soles of half-sitting [rad], [m]
_SQUAT = 0.525  # of the leg's length between hip and ankle: the deepest squat of a hit


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
        """Load the URDF that the robot's configuration names.

        Raises:
            RobotConfigError: A leg or a sole is of another kind than `leg_ik` solves, or soles
                of half-sitting are not on one floor.
        """
        self.config = config
        self.model: Any = free_floating_model(config)
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
        self.leg_columns = {side: self.indices(config.legs[side]) for side in SIDES}
        self.arm_columns = self.indices(config.arm.joints)
        self.leg_chains = {side: self._chain(self.feet[side].frame) for side in SIDES}
        self.hand_chain = self._chain(config.hand_link)
        contact = self.model.frames[self._frame_id(config.contact_link)]
        self._contact_joint = int(contact.parentJoint)
        self._contact_offset = np.array(contact.placement.translation)
        self._require_level_soles()

    # -- configuration ---------------------------------------------------------------------

    def configuration(self, base: ArrayLike, joints: ArrayLike) -> Array:
        """Pinocchio's q for an upright base at a position (3,) [m] and joints (J,) [rad]."""
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

    def mass_matrix(self, q: Array) -> Array:
        """Pinocchio's joint-space inertia, without rotors, (nv, nv)."""
        upper = np.triu(np.array(pin.crba(self.model, self.data, q)))
        return np.asarray(upper + np.triu(upper, 1).T)

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

    def contact_turn_jacobian(self, q: Array) -> Array:
        """Angular part of the contact body's Jacobian, axes of odom, (3, nv)."""
        pin.computeJointJacobians(self.model, self.data, q)
        return np.array(pin.getJointJacobian(
            self.model, self.data, self._contact_joint,
            pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)[3:])

    def effective_mass(
        self,
        q: Array,
        *,
        locked: Sequence[str],
        feet: Sequence[str] = SIDES,
        direction: ArrayLike = TOWARDS_DOOR,
        rotors: float = 0.0,
    ) -> float:
        """Mass that point B shows to a blow while joints yield [kg].

        The operational inertia (Khatib 1987)
        ``1 / (J_B (M^-1 - M^-1 Jc^T (Jc M^-1 Jc^T)^-1 Jc M^-1) J_B^T)`` with the feet fixed on the
        floor as constraints Jc. `hit_response` is what a plan goes by.

        Args:
            q: Configuration at the hit.
            locked: Joints that do not yield.
            feet: Sides whose foot stays put, of ``right`` and ``left``; may be empty.
            direction: Of the blow in odom, (3,).
            rotors: Multiple of the rotors' inertia, gear^2 J, that is added to each joint.
        """
        m = self.mass_matrix(q)
        m[self.v_index, self.v_index] += rotors * self.config.armature
        free = np.setdiff1d(np.arange(self.model.nv), self.v_index[self.indices(locked)])
        n = np.asarray(direction, dtype=float)
        jb = ((n / np.linalg.norm(n)) @ self.contact_jacobian(q))[free]
        minv = np.linalg.inv(m[np.ix_(free, free)])
        change = minv @ jb
        if feet:
            jc = np.vstack([self.frame_jacobian(q, self.feet[side].frame) for side in feet])
            jc = jc[:, free]
            mj = minv @ jc.T
            change = change - mj @ np.linalg.solve(jc @ mj, mj.T @ jb)
        return 1.0 / float(jb @ change)

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
        """Radius of the right hand [m]: the configured one, or of its collision sphere."""
        if self.config.hand_radius is not None:
            return self.config.hand_radius
        link = self.config.hand_link
        root = ElementTree.parse(self.config.urdf_path).getroot()
        sphere = root.find(f"./link[@name='{link}']/collision/geometry/sphere")
        if sphere is None:
            raise RobotConfigError(
                f"the URDF gives {link!r} no collision sphere", limit="one, or a hand_radius"
            )
        return float(sphere.attrib["radius"])

    def waist_heights(self) -> tuple[float, float]:
        """Heights of the base above the floor from a deep squat to stretched legs [m]."""
        leg, sole = self.legs["right"], self.feet["right"].sole
        length = leg.thigh + leg.shank
        floor = float(leg.hip[2] + sole[2])
        return _SQUAT * length - floor, length - floor

    # -- reading the model --------------------------------------------------------------------

    def _frame_id(self, name: str) -> int:
        if not self.model.existFrame(name):
            raise ValueError(f"the URDF has no frame {name!r}")
        return int(self.model.getFrameId(name))

    def _chain(self, frame: str) -> Chain:
        self._frame_id(frame)
        return Chain(self.model, self.joint_names, frame)

    def _leg(self, side: str) -> LegGeometry:
        names = ["root_joint", *self.config.legs[side]]
        offset = [self._leg_offset(i, names[i + 1], names[i]) for i in range(len(_LEG_KIND))]
        return LegGeometry(
            name=f"{side} leg",
            hip=offset[0],
            thigh=float(-offset[3][2]),
            shank=float(-offset[4][2]),
            lateral=float(offset[3][1] + offset[4][1]),
        )

    def _leg_offset(self, place: int, name: str, before: str) -> Array:
        """Place of a leg's joint in the one before, (3,) [m]; it must be as `_LEG_KIND` says."""
        what, axis, free = _LEG_KIND[place]

        def require(fits: bool, quantity: str, value: object, limit: str) -> None:
            if not fits:
                raise RobotConfigError(
                    f"{name} is not the {what} of a leg that the planner solves: {quantity}",
                    value=value,
                    limit=limit,
                )

        index = self.model.getJointId(name)
        parent = str(self.model.names[self.model.parents[index]])
        require(parent == before, "joint before it", parent, before)
        kind = str(self.model.joints[index].shortname())
        require(kind == f"JointModel{axis}", "axis", kind, f"JointModel{axis}")
        placement = self.model.jointPlacements[index]
        require(
            _is_parallel(placement), "frame in the zero posture",
            np.round(placement.rotation, 3).tolist(), "parallel to the base",
        )  # fmt: skip
        offset = np.array(placement.translation)
        aside = [abs(x) for x, letter in zip(offset, "xyz", strict=True) if letter not in free]
        require(
            max(aside, default=0.0) < _PARALLEL and (free != _BELOW or offset[2] < 0.0),
            "offset [m]", offset.round(4).tolist(), f"along {free or 'no axis'} only, not upwards",
        )  # fmt: skip
        return offset

    def _foot(self, side: str) -> Foot:
        name = self.config.feet[side].sole
        frame = self.model.frames[self._frame_id(name)]
        last, carrier = self.config.legs[side][-1], str(self.model.names[frame.parentJoint])
        if carrier != last:
            raise RobotConfigError(f"{name} hangs on another joint", value=carrier, limit=last)
        if not _is_parallel(frame.placement):
            raise RobotConfigError(
                f"{name} is not parallel to the base in the zero posture",
                value=np.round(frame.placement.rotation, 3).tolist(),
                limit="parallel",
            )
        return Foot(
            frame=name,
            sole=np.array(frame.placement.translation),
            rectangle=self.config.soles[side],
        )

    def _require_level_soles(self) -> None:
        """Motions begin in half-sitting, with soles level and parallel to the base."""
        q = self.configuration(np.zeros(3), self.config.half_sitting)
        poses = {side: self.frame_pose(q, self.feet[side].frame) for side in SIDES}
        for side, (position, rotation) in poses.items():
            tilt = float(np.abs(rotation - np.eye(3)).max())
            step = float(abs(position[2] - poses[SIDES[0]][0][2]))
            if max(tilt, step) > _LEVEL:
                raise RobotConfigError(
                    f"half_sitting: the {side} sole is not level, parallel to the base and on one "
                    "floor with the other: tilt [rad] and height [m]",
                    value=(round(tilt, 5), round(step, 5)),
                    limit=_LEVEL,
                )


def braced_upper_body(robot: RobotModel) -> Array:
    """Half-sitting with the right arm braced, (30,) [rad]."""
    return np.asarray(robot.config.posture(robot.config.braced_posture), dtype=float)


def _is_parallel(placement: Any) -> bool:
    return bool(np.abs(placement.rotation - np.eye(3)).max() < _PARALLEL)
