"""Points, lines and configurations of a plan in odom, as the paper's Fig. 5 shows them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES
from hrp2_description.support import support_polygon
from humanoid_motion.robot_model import RobotModel

from impact_planner.hit.leaf import LeafFrame
from impact_planner.hit.stance import initial_feet
from impact_planner.impact_plan import ImpactPlan
from impact_planner.motion.catch import LATE
from impact_planner.motion.phase_plan import PhasePlan

_TOUCH = 5e-4  # distance between hand and leaf that counts as contact [m]


@dataclass(frozen=True)
class PlanScene:
    """Points, lines and configurations of a plan; all places are in odom.

    Attributes:
        q_hit: Configuration of the robot at the hit.
        q_end: Configuration of the robot at the end of the last phase.
        feet_start: Places of the soles before the step by side, (3,) each [m].
        feet: Places of the soles at the hit by side, (3,) each [m].
        support: Corners of the support polygon at the hit, (M, 2) [m].
        com: Point G, the CoM at the hit, (3,) [m].
        b: Point B, where the elbow touches the leaf, (3,) [m].
        c: Point C on the inner edge of the right sole at the x of G, (3,) [m].
        hinge: x and y of point A, the hinge, (2,) [m].
        width: Width of the leaf [m].
        thickness: Thickness of the leaf [m].
        elbow_end: Centre of the contact body at the end of the last phase, (3,) [m].
        hand_end: Centre of the hand at the end of the last phase, (3,) [m].
        com_course: Course of the CoM from the start of the run-up to the contact, (N, 3) [m].
        zmp_course: Course of the ZMP from the start of the run-up to the contact, (N, 2) [m].
        steady: Places of the CoM at the ends of the required stretch of constant speed,
            (2, 3) [m].
        no_return: Place of the CoM at the point of no return, (3,) [m].
    """

    q_hit: Array
    q_end: Array
    feet_start: dict[str, Array]
    feet: dict[str, Array]
    support: Array
    com: Array
    b: Array
    c: Array
    hinge: Array
    width: float
    thickness: float
    elbow_end: Array
    hand_end: Array
    com_course: Array
    zmp_course: Array
    steady: Array
    no_return: Array

    def leaf_corners(self, angle: float) -> Array:
        """Corners of the leaf from above at an opening angle [rad], face first, (4, 2) [m]."""
        leaf = LeafFrame(self.hinge, angle)
        places = ((0.0, 0.0), (self.width, 0.0), (self.width, -self.thickness),
                  (0.0, -self.thickness))
        return np.array([leaf.point(radius, 0.0, gap)[:2] for radius, gap in places])

    def arc(self, radius: float, low: float, high: float) -> Array:
        """Arc of a point of the face at a radius [m] between opening angles [rad], (N, 2) [m]."""
        return LeafFrame(self.hinge, np.linspace(low, high, 40)).point(radius, 0.0, 0.0)[:, :2]


def plan_scene(plan: ImpactPlan, robot: RobotModel) -> PlanScene:
    """Compute the scene of a plan.

    Args:
        plan: The plan.
        robot: Robot that the plan is for.
    """
    cam, last = plan.phase("cam"), plan.phases[-1]
    q_hit = configuration_at(plan, robot, cam, plan.contact_time)
    q_end = configuration_at(plan, robot, last, float(last.time[-1]))
    feet = {"left": plan.left_foot, "right": plan.right_foot}
    before = cam.time <= plan.contact_time
    leaf = plan.phase("post").leaf
    assert leaf is not None
    com = robot.com(q_hit)
    lost = plan.contact_time - plan.point_of_no_return

    steady = np.tile(com, (2, 1))
    steady[:, 1] += [0.5 * plan.steady_way, -0.5 * plan.steady_way]
    return PlanScene(
        q_hit=q_hit,
        q_end=q_end,
        feet_start=initial_feet(robot),
        feet=feet,
        support=support_polygon(*(robot.feet[side].corners(feet[side]) for side in SIDES)),
        com=com,
        b=plan.contact_point,
        c=np.array([com[0], plan.right_foot[1] + robot.feet["right"].rectangle[3], 0.0]),
        hinge=leaf.hinge,
        width=leaf.width,
        thickness=leaf.thickness,
        elbow_end=robot.contact_position(q_end),
        hand_end=robot.frame_position(q_end, robot.config.hand_link),
        com_course=cam.com_samples[before],
        zmp_course=cam.zmp_samples[before],
        steady=steady,
        no_return=np.array(
            [np.interp(lost, cam.time, column) for column in cam.com_samples.T]),
    )


def configuration_at(
    plan: ImpactPlan, robot: RobotModel, phase: PhasePlan, time: float
) -> Array:
    """Configuration of the robot in odom at a time of a phase [s].

    It stands on its left sole, which does not move in any phase.
    """
    joints, _, _ = phase.knots.at(time)
    sole = robot.frame_position(
        robot.configuration(np.zeros(3), joints), robot.feet["left"].frame)
    return robot.configuration(plan.left_foot - sole, joints)


def door_course(plan: ImpactPlan) -> tuple[Array, Array, float]:
    """Course of the door after the hit.

    The planner assumes that the peak is detected `hold.LATE` after it, which starts the last
    phase.

    Returns:
        Times after the hit (N,) [s], opening angles (N,) [rad], start of the last phase [s].
    """
    post, last = plan.phase("post"), plan.phases[-1]
    assert post.leaf is not None
    assert last.leaf is not None
    start = plan.peak_time + LATE
    free = post.time + (plan.switch_time - plan.contact_time)
    time = np.concatenate([[0.0], free[free > 0.0], start + last.time])
    angle = np.concatenate([
        [plan.initial_angle], post.leaf.angle[free > 0.0], last.leaf.angle])
    return time, angle, start


def caught_after(plan: ImpactPlan, robot: RobotModel) -> float:
    """Time from the start of the phase `hold` until the hand meets the leaf [s]."""
    hold = plan.phase("hold")
    assert hold.leaf is not None
    joints, _, _ = hold.knots.at(hold.time)
    still = np.zeros((len(joints), 3))
    base = plan.left_foot - robot.leg_chains["left"].place(joints, still).end
    hand = robot.hand_chain.place(joints, base).end
    gap = LeafFrame(hold.leaf.hinge, hold.leaf.angle).gap(hand)
    apart = np.flatnonzero(gap > robot.hand_radius() + _TOUCH)
    return float(hold.time[apart[-1] + 1]) if apart.size else 0.0
