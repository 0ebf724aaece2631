"""The braced posture, section II.C.1: upper arm and forearm in one frontal plane, leaning on pads.

The paper fixes the arm close to the upper body. Here the forearm's end leans on the side of the
trunk, so that the load of the hit runs along the forearm into the trunk. Upper arm and forearm lie
in the frontal plane through the trunk's pad. For each distance of the elbow from the middle of the
robot there is one such posture, with a height of the pad of its own: an elbow that is far out makes
the forearm flat and the upper arm flat, too, one that is near makes both steep. `braced_arm` finds
the posture, and `load_path` describes how the load runs. The command ``hit_bodies`` compares hits
in several of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import RobotConfig, needed
from humanoid_motion.clearance import BodyGeometry
from humanoid_motion.errors import PostureUnreachable
from humanoid_motion.motion import still
from humanoid_motion.pads import pad_contact
from humanoid_motion.robot_model import RobotModel, braced_upper_body
from scipy.optimize import least_squares

from impact_planner.hit.posture import RESERVE
from impact_planner.hit.stance import initial_base

DEPTH = 1.5e-3  # depth to which the commanded posture presses the pads [m]
_EXACT = 1e-6  # largest error of elbow and wrist [m]
_BENDING = 4  # number of the arm's joints that place elbow and wrist, from the shoulder
_TURNS = np.radians(np.arange(-90.0, 91.0, 10.0))  # angles tried for each joint of the hand


@dataclass(frozen=True)
class BracedArm:
    """A posture of the arm that leans on the trunk.

    Attributes:
        joints: Angles of the arm's joints by name [rad].
        pad: Middle of the trunk's pad in its link's frame, (3,) [m].
        elbow: Place of the elbow in base_link's axes, relative to base_link, (3,) [m].
    """

    joints: dict[str, float]
    pad: tuple[float, float, float]
    elbow: tuple[float, float, float]

    def of(self, config: RobotConfig) -> RobotConfig:
        """The configuration of a robot whose braced posture is this one."""
        brace = needed(config.brace, "brace")
        return replace(
            config, braced_posture=dict(config.braced_posture) | self.joints,
            brace=replace(brace, trunk=replace(brace.trunk, place=self.pad)))


@dataclass(frozen=True)
class LoadPath:
    """How the load of a hit at the elbow runs into the trunk.

    Attributes:
        inclination: Angle between the forearm, from elbow to pad, and the pad's normal [rad].
        cone: Half angle of the pads' friction cone [rad].
        aside: Distance of the elbow from the frontal plane through the middle of the pads, along
            x [m].
        beside: Distance of the arm's pad from the middle of the trunk's [m].
        depth: Depth to which the pads are pressed [m].
    """

    inclination: float
    cone: float
    aside: float
    beside: float
    depth: float


def load_path(robot: RobotModel) -> LoadPath:
    """Find how the load of a hit runs in the configured braced posture.

    Raises:
        RobotConfigError: The robot has no brace.
    """
    brace = needed(robot.config.brace, "brace")
    q = robot.configuration(np.zeros(3), braced_upper_body(robot))
    found = pad_contact(robot, q, brace)
    elbow, ball = robot.contact_position(q), _ball(robot, q)
    along = (ball - elbow) / np.linalg.norm(ball - elbow)
    middle = _pad_middle(robot, q)
    return LoadPath(
        inclination=math.acos(min(1.0, -float(along @ found.axes[0]))),
        cone=math.atan(brace.friction),
        aside=float(elbow[0] - middle[0]),
        beside=float(np.hypot(*found.offset[1:])),
        depth=-float(found.offset[0]))


def braced_arm(robot: RobotModel, elbow_distance: float, depth: float = DEPTH) -> BracedArm:
    """Find the posture in which the arm leans on the trunk with its elbow at a distance.

    The hand turns out of the way of trunk and thigh: of the angles that keep the clearance, those
    nearest to the configured ones are taken.

    Args:
        robot: The robot, whose braced posture is the first guess and whose pads are used. The
            trunk's pad keeps its frontal plane and moves along the vertical.
        elbow_distance: Distance of the elbow's middle from base_link's middle, towards the door
            [m].
        depth: Depth to which the pads are pressed [m].

    Raises:
        PostureUnreachable: The arm does not reach within its ranges, or no turn of the hand keeps
            the clearance.
        RobotConfigError: The robot has no brace.
    """
    brace = needed(robot.config.brace, "brace")
    columns = robot.arm_columns[:_BENDING]
    upper = braced_upper_body(robot)
    plane = _pad_middle(robot, robot.configuration(np.zeros(3), upper))[0]

    def error(angles: Array) -> Array:
        upper[columns] = angles
        q = robot.configuration(np.zeros(3), upper)
        elbow, offset = robot.contact_position(q), pad_contact(robot, q, brace).offset
        return np.array([
            elbow[0] - plane, elbow[1] + elbow_distance, _ball(robot, q)[0] - plane,
            offset[0] + depth])

    low, high = robot.lower[columns] + RESERVE, robot.upper[columns] - RESERVE
    found = least_squares(
        error, np.clip(upper[columns], low, high), bounds=(low, high), xtol=1e-14, ftol=1e-14,
        gtol=1e-14)
    miss = float(np.abs(error(found.x)).max())
    if miss > _EXACT:
        raise PostureUnreachable(
            f"the arm cannot lean on the trunk with its elbow {elbow_distance:.3f} m from the "
            f"middle: elbow or wrist would miss their places by {1e3 * miss:.1f} mm within the "
            "joints' ranges", quantity="distance of the elbow [m]", value=elbow_distance)
    q = robot.configuration(np.zeros(3), upper)
    trunk, turn = robot.frame_pose(q, brace.trunk.link)
    place = turn.T @ (_ball(robot, q) - trunk)
    normal = np.array(brace.normal)
    place -= normal * (normal @ (place - np.array(brace.trunk.place)))
    return BracedArm(
        _hand_clear(robot, upper), tuple(place.tolist()),
        tuple(robot.contact_position(q).tolist()))


def _hand_clear(robot: RobotModel, upper: Array) -> dict[str, float]:
    """Angles of the arm's joints whose hand keeps the clearance from the rest of the robot [rad].

    Raises:
        PostureUnreachable: There are none.
    """
    columns = robot.arm_columns
    turning = columns[_BENDING:_BENDING + 2]
    wanted = upper[turning].copy()
    choices = [wanted, *(np.array([a, b]) for a in _TURNS for b in _TURNS)]
    choices.sort(key=lambda each: float(np.abs(each - wanted).sum()))
    base = initial_base(robot)
    limit = robot.config.clearance
    bodies = BodyGeometry(robot)
    for each in choices:
        if not ((robot.lower[turning] + RESERVE <= each)
                & (each <= robot.upper[turning] - RESERVE)).all():
            continue
        upper[turning] = each
        if bodies.self_clearance(still(upper, base), limit).distance >= limit:
            names = [robot.joint_names[column] for column in columns]
            return dict(zip(names, upper[columns].tolist(), strict=True))
    raise PostureUnreachable(
        f"no turn of the hand keeps {1e3 * limit:.0f} mm from trunk and thigh",
        quantity="clearance [m]", limit=limit)


def _ball(robot: RobotModel, q: Array) -> Array:
    """Middle of the arm's ball in odom, (3,) [m]."""
    pad = needed(robot.config.brace, "brace").arm
    place, turn = robot.frame_pose(q, pad.link)
    return np.asarray(place + turn @ np.array(pad.place))


def _pad_middle(robot: RobotModel, q: Array) -> Array:
    """Middle of the trunk's pad in odom, (3,) [m]."""
    pad = needed(robot.config.brace, "brace").trunk
    place, turn = robot.frame_pose(q, pad.link)
    return np.asarray(place + turn @ np.array(pad.place))
