"""How far the robot is from its plan: the error of its capture point (DCM).

The capture point c + c' / w of the CoM c is where the robot, as a linear inverted pendulum, would
have to stand to come to rest (Pratt et al., 2006; Englsberger et al., 2015). A push moves it; the
joints of HRP-2 are stiff, so that the body then tilts as a whole about its standing sole, and joint
angles and IMU together show where the CoM is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY
from hrp2_description.robot import SIDES, needed
from humanoid_motion.kinematics import planar_pose
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.samples import ImuSample, Measured

from walking.footsteps.footstep import Pose, Stance, as_array, other, wrapped
from walking.pattern.course import Course, central
from walking.pattern.timing import Phase
from walking.pattern.walk_plan import WalkPlan
from walking.pattern.whole_body import feet_ahead, twist

_SMOOTHING = 0.015  # time constant with which the measured point corrects the pendulum's [s]
_TOUCH = 30.0  # normal force above which a sole counts, of HRP-2 [N]
_STEP = 0.002  # step of the central differences [s]
# Moment of inertia of the robot about its CoM, as a share of that of its mass at the CoM's height.
_INERTIA = 0.2
_BEARS = 100.0  # normal force of both soles above which there is a ZMP, of HRP-2 [N]


@dataclass(frozen=True)
class ComState:
    """Position and velocity of the CoM, on the floor in odom.

    Attributes:
        com: x and y, (2,) [m].
        velocity: Velocity along x and y, (2,) [m/s].
        height: Height of the CoM above the floor [m].
        turning: Velocity along x and y that the CoM gains when the body stops turning, (2,) [m/s].
    """

    com: Array
    velocity: Array
    height: float
    turning: Array

    @property
    def frequency(self) -> float:
        """Natural frequency of the pendulum [rad/s]."""
        return math.sqrt(GRAVITY / self.height)

    @property
    def capture_point(self) -> Array:
        """x and y of the capture point in odom, (2,) [m]."""
        return np.asarray(self.com + (self.velocity + self.turning) / self.frequency)


def com_over_sole(
    robot: RobotModel, side: str, sole: Pose, position: Array, velocity: Array,
    imu: ImuSample | None,
) -> ComState:
    """Compute where the CoM is, with one sole's middle resting on the floor.

    Args:
        side: Side of the sole that bears the load.
        sole: Its pose in odom.
        position: Joint positions, (J,) [rad].
        velocity: Joint velocities, (J,) [rad/s].
        imu: Reading of the IMU; None means that base_link is upright.
    """
    model, data = robot.model, robot.data
    q, v = pin.neutral(model), np.zeros(model.nv)
    q[robot.q_index], v[robot.v_index] = position, velocity
    foot = model.getFrameId(robot.feet[side].frame)
    pin.forwardKinematics(model, data, q, v)
    sole_in_base = pin.updateFramePlacement(model, data, foot)
    turn, rate = np.eye(3), np.zeros(3)
    if imu is not None:
        frame = model.getFrameId(needed(robot.config.imu_frame, "imu_frame"))
        in_base = pin.updateFramePlacement(model, data, frame).rotation
        own = pin.getFrameVelocity(model, data, frame, pin.ReferenceFrame.LOCAL).angular
        turn = imu.rotation @ in_base.T
        rate = turn @ in_base @ (imu.angular_velocity - own)
    x_axis = turn @ sole_in_base.rotation[:, 0]
    heading = planar_pose(0.0, 0.0, sole.yaw - math.atan2(x_axis[1], x_axis[0]))[:3, :3]
    turn, rate = heading @ turn, heading @ rate
    x_min, x_max, y_min, y_max = robot.feet[side].rectangle
    middle = np.array([0.5 * (x_min + x_max), 0.5 * (y_min + y_max), 0.0])
    arm = sole_in_base.rotation @ middle
    twist = pin.getFrameVelocity(model, data, foot, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
    pivot = sole_in_base.translation + arm
    pivot_speed = twist.linear + np.cross(twist.angular, arm)
    com = np.array(pin.centerOfMass(model, data, q, v))
    away = turn @ (com - pivot)
    speed = turn @ (np.array(data.vcom[0]) - pivot_speed) + np.cross(rate, away)
    place = np.array(sole.moved(middle[0], middle[1])[:2])
    turning = _INERTIA * away[2] * np.array([rate[1], -rate[0]])
    return ComState(place + away[:2], speed[:2], float(away[2]), turning)


@dataclass(frozen=True)
class Balance:
    """What is known of the robot's balance at one time.

    Attributes:
        stamp: Time of the measurement [s].
        com: Measured state of the CoM.
        capture_point: Filtered place of the capture point in odom, (2,) [m].
        planned: Its place in the plan's reference, (2,) [m].
        phase: The plan's phase.
    """

    stamp: float
    com: ComState
    capture_point: Array
    planned: Array
    phase: Phase


def watch(
    robot: RobotModel, plan: WalkPlan, time: float, measured: Measured,
    before: Balance | None = None,
) -> Balance:
    """Estimate the robot's balance.

    Between two measurements the capture point moves as the pendulum's under the measured ZMP; the
    measured one corrects it. So trembling legs, whose speed is part of the measured one, matter
    less. The longer nothing was measured, the less the estimate before counts.

    Args:
        plan: The plan that the driver follows.
        time: Time since its beginning [s].
        measured: What was measured then.
        before: The estimate at the sample before; None for the first one.
    """
    time = max(time, 0.0)
    phase = plan.phase_at(time)
    if phase.kind == "single":
        side = phase.sides[0]
    else:
        side = "left" if measured.left_wrench[2] >= measured.right_wrench[2] else "right"
    sole = phase.stance.foot(side)
    now = com_over_sole(robot, side, sole, measured.position, measured.velocity, measured.imu)
    position, velocity, _ = plan.knots.at(time)
    reference = com_over_sole(robot, side, sole, position[0], velocity[0], None)
    point = now.capture_point
    if before is not None:
        zmp, elapsed = _zmp(robot, phase, measured), measured.time - before.stamp
        moved = before.capture_point
        if zmp is not None:
            moved = moved + elapsed * now.frequency * (moved - zmp)
        point = moved + elapsed / (elapsed + _SMOOTHING) * (point - moved)
    return Balance(measured.time, now, point, reference.capture_point, phase)


def _zmp(robot: RobotModel, phase: Phase, measured: Measured) -> Array | None:
    """Compute the ZMP from the wrenches in odom, (2,) [m]; None if the feet bear too little."""
    force, moment, scale = 0.0, np.zeros(2), robot.config.mass_scale
    for side, wrench in (("left", measured.left_wrench), ("right", measured.right_wrench)):
        if wrench[2] > _TOUCH * scale:
            place = phase.stance.foot(side).moved(-wrench[4] / wrench[2], wrench[3] / wrench[2])
            force += float(wrench[2])
            moment += wrench[2] * np.array(place[:2])
    return moment / force if force > _BEARS * scale else None


@dataclass(frozen=True)
class ReferenceState:
    """Where the reference is and how it moves, at one time.

    Each course has one sample without an axis for it: value, speed and acceleration.

    Attributes:
        stance: Poses of the soles; that of a swing foot is the one before its step.
        swing: Foot in the air; empty in double support.
        com: x and y of the CoM in odom, (2,) [m].
        foot: x, y, z [m] and yaw [rad] of the swing foot in odom, (4,); the standing foot's own
            pose if there is none.
        waist: Height of base_link, () [m].
        upper: Joints without the twist of the chest, (J,) [rad].
    """

    stance: Stance
    swing: str
    com: Course
    foot: Course
    waist: Course
    upper: Course


def reference_at(robot: RobotModel, plan: WalkPlan, time: float, chest_swing: float,
                 ) -> ReferenceState:
    """Compute the state of a plan's reference.

    Args:
        time: Time since its beginning [s]; after its end it rests.
        chest_swing: Turn of the chest per distance between the feet in the plan [rad/m].
    """
    phase = plan.phase_at(time)
    swing = phase.swing if phase.kind == "single" else ""
    standing = other(swing) if swing else "left"
    joints = Course(*(rows[0] for rows in plan.knots.at(time)))
    rows = joints.around(_STEP)
    places = np.array([
        _placed(robot, row, standing, phase.stance.foot(standing)) for row in rows])
    # Columns: CoM x, y; height of base_link; its heading; x, y, z, yaw of the other sole.
    apart = places[:, 4:6] - as_array(phase.stance.foot(standing))[:2]
    if standing == "left":
        apart = -apart
    ahead = feet_ahead(apart, places[:, 3])
    upper = rows.copy()
    twist(robot, upper, -chest_swing * ahead)
    course = central(places, _STEP)
    return ReferenceState(
        phase.stance, swing, _columns(course, slice(0, 2)), _columns(course, slice(4, 8)),
        _columns(course, 2), central(upper, _STEP))


def _columns(course: Course, which: slice | int) -> Course:
    return Course(*(rows[which] for rows in course))


def _placed(robot: RobotModel, joints: Array, side: str, sole: Pose) -> Array:
    """Place the upright robot on one sole: CoM, base_link, and the other sole, (8,)."""
    q = robot.configuration(np.zeros(3), joints)
    com = robot.com(q)[:2]
    feet = {}
    for foot in SIDES:
        place, turn = robot.frame_pose(q, robot.feet[foot].frame)
        feet[foot] = (place, math.atan2(turn[1, 0], turn[0, 0]))
    place, yaw = feet[side]
    base_yaw = sole.yaw - yaw
    cos, sin = math.cos(base_yaw), math.sin(base_yaw)

    def moved(x: float, y: float) -> tuple[float, float]:
        x, y = x - place[0], y - place[1]
        return sole.x + cos * x - sin * y, sole.y + sin * x + cos * y

    free, free_yaw = feet[other(side)]
    free_x, free_y = moved(free[0], free[1])
    return np.array([
        *moved(com[0], com[1]), -place[2], base_yaw, free_x, free_y, free[2] - place[2],
        sole.yaw + wrapped(free_yaw - yaw)])
