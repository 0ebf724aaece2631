"""Search for the link of the arm that hits and for its braced posture, section II.C.1.

A posture counts if, over the feet of a nominal step, B can be as high as eq. (5) asks and is beside
the CoM, the contact body is the robot's outermost towards the door, the arm gets there from
half-sitting clear of all bodies, and, with a brace, the trunk is behind the arm's pad. The best one
has the least mobility at B: that of eq. (3), and what gears and pads give in the contact.
"""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import Brace, RobotConfig
from humanoid_motion.clearance import BodyGeometry, LeafCourse
from humanoid_motion.motion import from_derivatives, still
from humanoid_motion.pads import TANGENTIAL, pad_contact
from humanoid_motion.pinocchio_model import pin
from humanoid_motion.robot_model import TOWARDS_DOOR, RobotModel
from numpy.typing import NDArray
from scipy.optimize import differential_evolution

from impact_planner.hit.momentum import effective_mass_planar
from impact_planner.hit.posture import RESERVE, LegDemands, at_heights, incapable
from impact_planner.hit.stance import SPARE_DISTANCE, place_feet
from impact_planner.task.settings import PlannerSettings

_HEIGHTS, _SAMPLES = 30, 12  # numbers of heights of the waist, and of samples of the arm's way
_RADII = 0.03, 0.08  # least and largest radius of the contact body, as of HRP-2's height [m]
_OFFSET = 0.025  # largest distance of B from the CoM along x, as of HRP-2's sole [m]
_BEHIND = 0.004  # by which bodies are farther from the leaf than they must be: it turns [m]
_COLUMN = 0.10  # from the arm's pad to the farthest trunk behind it, as of HRP-2's height [m]
_PRESSED = 1.5e-3  # depth to which the commanded posture presses the pads [m]
_FAR = 2.0  # from base_link to the plane from which the outermost body is found [m]
_DIFFERENT = 10.0  # least difference of a joint in postures that count as different [deg]
_AT_EASE = 0.05  # share of the mobility that idle joints cost 1 rad off half-sitting [1/rad^2]
_FAILED = 1e6  # more than any mobility [1/kg]
_SHORT = (  # what fails, in the order of the checks
    "B misses the height of eq. (5) by {:.2f} of a_r", "B is {:.3f} m too far from the CoM along x",
    "the radius of an outermost ball would be {:.3f} m too large",
    "on its way from half-sitting the arm is {:.3f} m too near to a body",
    "the trunk is {:.3f} m too far from the arm's pad")


class ArmSearch:
    """The search for one robot, of which contact body, braced arm and place of the pads are free.

    Raises:
        PostureUnreachable: The legs do not reach the nominal step.
    """

    def __init__(self, robot: RobotModel, settings: PlannerSettings) -> None:
        # In the geometry of the file's braced posture, bodies that overlap there would not count.
        self._robot = RobotModel(replace(robot.config, braced_posture={}))
        self._bodies, self._file = BodyGeometry(self._robot), robot.config
        self._rate = math.pi / settings.contact_duration
        feet, com, over_left = place_feet(
            robot, robot.config.step.nominal, settings.com_inside_edge)
        demands = LegDemands(beyond=settings.door_uncertainty + SPARE_DISTANCE)
        heights = np.linspace(*robot.waist_heights(), _HEIGHTS)
        excess, joints, base = at_heights(
            self._robot, heights, com, feet, demands, [over_left])
        within = excess.max(axis=1) <= 0.0
        if not within.any():
            raise incapable(robot, excess, feet, demands)
        self._joints, self._base = joints[within], base[within]

    def links(self) -> list[str]:
        """Return the links from the shoulder to the wrist."""
        chain = self._movers(self._file.arm.wrist_link)
        return [frame.name for frame in self._robot.model.frames
                if frame.type == pin.FrameType.BODY
                and self._robot.model.names[frame.parentJoint] in chain]

    def best(self, link: str, count: int) -> tuple[list[RobotConfig], str]:
        """Find postures that differ, the best one first, with a link as the contact body.

        Returns:
            The robot with each of them; and what is missing where there is none.
        """
        robot, columns, found, least = self._robot, self._robot.arm_columns, [], math.inf
        moves = np.isin(self._file.arm.joints, [*self._movers(link)])

        def judged(arm: Array) -> float:
            nonlocal least
            value, config = self._judge(arm.round(2), link, ~moves)
            least = min(least, value)
            if config is not None:
                found.append((value, arm, config))
            return value

        bounds = np.degrees([robot.lower[columns] + RESERVE, robot.upper[columns] - RESERVE])
        differential_evolution(judged, list(bounds.T), seed=1, popsize=8, maxiter=50, tol=0.0,
                               init="sobol", polish=False)
        chosen: list[tuple[Array, RobotConfig]] = []
        for _, arm, config in sorted(found, key=lambda each: each[0]):
            if all(np.abs(arm - other)[moves].max() > _DIFFERENT for other, _ in chosen):
                chosen.append((arm, config))
        left, short = divmod(least - _FAILED, 1.0)
        return [config for _, config in chosen[:count]], (
            "" if chosen else _SHORT[-1 - int(left)].format(short))

    def _movers(self, link: str) -> set[str]:
        """Return the joints of the arm that move a link."""
        model = self._robot.model
        moved = model.supports[model.frames[model.getFrameId(link)].parentJoint]
        return {model.names[joint] for joint in moved} & {*self._file.arm.joints}

    def _judge(
        self, arm: Array, link: str, idle: NDArray[np.bool_]
    ) -> tuple[float, RobotConfig | None]:
        """Judge a posture of the arm [deg] by its mobility at B [1/kg].

        One that fails gets more, the more checks are left and the more it lacks.
        """
        robot, config, joints = self._robot, self._file, self._joints.copy()
        joints[:, robot.arm_columns] = np.radians(arm)
        every = robot.configurations(self._base, joints)
        com = np.array([robot.com(q) for q in every])
        b = np.array([robot.frame_position(q, link) for q in every])
        i_rob = np.array([robot.inertia_about_com(q)[0, 0] for q in every])
        ahead, _, a_r = (b - com).T
        excess = robot.mass * a_r * com[:, 2] / i_rob - 1.0  # of a_r over that of eq. (5)
        at = int(np.argmin(np.abs(excess)))
        q = every[at]
        brace = config.brace and pressed(robot, q, config.brace)
        for left, lacks in zip(range(len(_SHORT))[::-1], (
            lambda: np.abs(excess[at]) if excess.min() > 0.0 or excess.max() < 0.0 else 0.0,
            lambda: np.abs(ahead[at]) - _OFFSET * config.sole_scale,
            lambda: self._radius(q, link) - _RADII[1] * robot.height_scale,
            lambda: self._nearness(joints[at]),
            lambda: self._off_trunk(q, brace) if brace else 0.0,
        ), strict=True):
            short = float(lacks())
            if short > 0.0:
                return _FAILED + left + min(short, 0.99), None
        mobility = 1.0 / effective_mass_planar(robot.mass, float(i_rob[at]), float(a_r[at]))
        mobility += self._compliance(q, link, brace) * self._rate**2
        off = (joints[at] - config.half_sitting)[robot.arm_columns[idle]]
        posture = dict(zip(config.arm.joints, np.radians(arm).tolist(), strict=True))
        return mobility * (1.0 + _AT_EASE * float(off @ off)), replace(
            config, contact_link=link, contact_radius=math.ceil(1e3 * self._radius(q, link)) / 1e3,
            brace=brace, braced_posture={**config.braced_posture, **posture})

    def _radius(self, q: Array, link: str) -> float:
        """Compute the radius of a ball around a link's origin that is the outermost body [m]."""
        x, y, z = q[:3].tolist()
        plane = LeafCourse(np.array([x, y]) - _FAR, np.zeros(1), 2.0 * _FAR, height=z + _FAR)
        own, others = (y - _FAR + self._bodies.leaf_clearance(
            still(q[self._robot.q_index], q[:3]), plane, 0.0, may_touch=left_out).distance
            for left_out in ({*self._bodies.links} - {link}, {link}))
        outermost = min(own, others - self._file.clearance - _BEHIND)
        return max(float(self._robot.frame_position(q, link)[1]) - outermost,
                   _RADII[0] * self._robot.height_scale)

    def _nearness(self, joints: Array) -> float:
        """Compute by how much bodies are too near on the arm's way from half-sitting [m]."""
        columns, course = self._robot.arm_columns, np.tile(joints, (_SAMPLES, 1))
        course[:, columns] = np.linspace(
            self._file.half_sitting[columns], joints[columns], _SAMPLES)
        course = np.pad(course, ((0, 0), (0, 3)))  # the place of the base does not matter
        near = self._bodies.self_clearance(from_derivatives(
            np.linspace(0.0, 1.0, _SAMPLES), course, course, course), self._file.clearance)
        return near.limit - near.distance

    def _off_trunk(self, q: Array, brace: Brace) -> float:
        """Compute how far the trunk is from a column from the arm's pad along +y [m]."""
        half, size = 0.5 * _COLUMN * self._robot.height_scale, brace.arm.size
        column: Any = SimpleNamespace(name="column", half=(size, half, size), center=tuple(
            (_ball(self._robot, q, brace) + [0.0, half, 0.0]).tolist()))
        found = self._bodies.frame_clearance(
            still(q[self._robot.q_index], q[:3]), [column], 0.0,
            may_touch={*self._bodies.links} - {brace.trunk.link})
        return found.distance if found.bodies else 0.0

    def _compliance(self, q: Array, link: str, brace: Brace | None) -> float:
        """Compute how far B gives per force by gears and pads, with the base at rest [m/N]."""
        robot, drives = self._robot, self._file.drives
        if drives is None:
            return 0.0
        stiffness = np.diag(drives.stiffness)
        if brace is not None:
            row = pad_contact(robot, q, brace).jacobian[:, robot.v_index]
            share = np.array([[1.0], [TANGENTIAL], [TANGENTIAL]])
            stiffness += row.T @ (brace.stiffness * share * row)
        along = np.array(TOWARDS_DOOR) @ robot.frame_jacobian(q, link)[:3, robot.v_index]
        return float(along @ np.linalg.solve(stiffness, along))


def pressed(robot: RobotModel, q: Array, brace: Brace) -> Brace:
    """Return a brace whose trunk's pad faces the door, and is pressed by the arm's pad."""
    trunk, turn = robot.frame_pose(q, brace.trunk.link)
    normal = np.array(TOWARDS_DOOR)
    place = turn.T @ (_ball(robot, q, brace) - (brace.arm.size - _PRESSED) * normal - trunk)
    return replace(brace, trunk=replace(
        brace.trunk, place=tuple(place.round(4).tolist()),
        normal=tuple((turn.T @ normal).round(6).tolist())))


def _ball(robot: RobotModel, q: Array, brace: Brace) -> Array:
    """Compute the middle of the arm's pad in odom, (3,) [m]."""
    place, turn = robot.frame_pose(q, brace.arm.link)
    return place + turn @ np.array(brace.arm.place)
