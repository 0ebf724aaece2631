"""The whole passage: hand, bodies, margins, stops."""

from dataclasses import replace

import numpy as np
import pytest
from humanoid_motion.clearance import LeafCourse, bodies_of
from humanoid_motion.leaf import LeafFrame
from walking.errors import PassageInfeasible, WalkInfeasible
from walking.passing.passage import plan_passage
from walking.passing.settings import PassageSettings, Way
from walking.passing.yielding import yielded
from walking.pattern.sections import rest_after

SETTINGS = PassageSettings()


def hand_of(robot, passage):
    """The hand's middle at the walk's knots, (N, 3) [m]."""
    motion = passage.walk.motion
    return robot.hand_chain.place(motion.joints, motion.base, motion.base_yaw.angle).end


def leaf_of(task, passage):
    """The leaf at the walk's knots."""
    return LeafFrame(task.doorway.hinge, passage.push.at(passage.walk.motion.time))


def test_the_hand_presses_with_the_closers_force_from_start_to_release(robot, task, passage):
    """It is behind the face by what it will have yielded, to 6 mm, and lies on the leaf."""
    holds = passage.walk.motion.time <= passage.push.release
    gap = leaf_of(task, passage).gap(hand_of(robot, passage))
    force = np.linalg.norm(passage.hand_force, axis=1)
    time = passage.walk.motion.time
    wanted = robot.hand_radius - yielded(time, force, SETTINGS)
    later = holds & (time > 0.5)
    assert np.abs(gap - wanted)[later].max() < 0.006
    radius = leaf_of(task, passage).radius(hand_of(robot, passage))
    assert SETTINGS.nearest - 0.01 <= radius[holds].min()
    assert radius[holds].max() <= task.doorway.leaf.width - 0.5 * robot.hand_radius
    assert (force[holds] > 0.0).mean() > 0.95
    assert not force[~holds].any()


def test_the_hand_never_has_to_pull(passage):
    """Only a hand that presses keeps the leaf, and a planned pull would tilt the robot."""
    time = np.linspace(0.0, passage.push.release, 200)
    closer = passage.push.door.restoring_torque(passage.push.at(time))
    assert (passage.push.torque(time) >= 0.1 * closer).all()


def test_the_force_of_the_leaf_pushes_the_hand_away_from_the_door(task, passage):
    normal = leaf_of(task, passage).normal
    assert ((passage.hand_force * normal).sum(axis=1) <= 1e-9).all()


def test_no_body_but_the_hand_and_forearm_comes_near_the_leaf(robot, task, passage):
    motion = passage.walk.motion
    angle = passage.push.at(motion.time)
    door = task.doorway
    leaf = LeafCourse(door.hinge, angle, door.leaf.width, thickness=door.leaf.thickness)
    arm = [link for link in bodies_of(robot).links
           if link.startswith(("RARM_LINK3", "RARM_LINK4", "RARM_LINK5", "RARM_LINK6", "r_"))]
    found = bodies_of(robot).leaf_clearance(motion, leaf, 0.03, may_touch=arm)
    assert found.distance >= 0.03
    assert passage.frame_clearance.distance >= 0.03
    assert passage.self_clearance.distance >= passage.self_clearance.limit


def test_the_zmp_stays_in_the_soles_under_the_hands_force(passage):
    assert passage.walk.checks.margin.min() >= 0.02
    assert passage.walk.checks.friction.max() <= 0.45
    assert passage.walk.checks.speed_ratio.max() <= 0.9 + 1e-9


def test_the_passage_can_be_ended_after_every_footstep(robot, passage):
    """The robot then stands, and its hand stays where the leaf is."""
    for step in range(len(passage.walk.footsteps)):
        rest = rest_after(robot, passage.walk, step, passage.pattern)
        assert rest.plan.checks.margin.min() >= 0.02
        assert np.abs(rest.knots.velocity[-1]).max() < 1e-3


def test_a_door_that_is_too_narrow_is_refused_before_anything_moves(robot, task, doorway):
    with pytest.raises(PassageInfeasible) as error:
        plan_passage(robot, replace(task, doorway=doorway(0.65)))
    assert error.value.quantity
    assert error.value.limit is not None


@pytest.mark.parametrize("off_deg", [-8.0, 8.0])
def test_a_hand_that_does_not_hold_the_leaf_is_refused(robot, task, off_deg):
    """The leaf stands elsewhere than the hand: nothing may be planned on it."""
    with pytest.raises(PassageInfeasible, match="the hand does not hold the leaf"):
        plan_passage(robot, replace(task, angle=task.angle + np.radians(off_deg)))


@pytest.mark.parametrize("width", [0.88, 1.0])
def test_other_leaves_are_passed_too(robot, task, doorway, width):
    plan = plan_passage(robot, replace(task, doorway=doorway(width)))
    assert plan.leaf_clearance.distance >= 0.03


def test_a_robot_that_holds_the_leaf_may_use_more_friction_than_one_that_has_not_moved(
        robot, task):
    """Standing with the leaf in the hand is the alternative."""
    slippery = PassageSettings(
        friction=0.2, held=((0.45, 0.04),), leaf_angles=(np.radians(75.0),))
    with pytest.raises(WalkInfeasible, match=r"0\.20 is assumed"):
        plan_passage(robot, task, slippery)
    found = plan_passage(robot, replace(task, measured=task.joints), slippery)
    assert 0.2 < found.walk.checks.friction.max() <= 0.45


def test_the_way_of_a_former_passage_is_tried_first(robot, task, passage):
    wider, gait = SETTINGS.wider[2], SETTINGS.gaits[1]
    other = Way(max(set(SETTINGS.leaf_angles) - {passage.way.leaf_angle}), wider, gait)
    assert plan_passage(robot, task, before=replace(passage, way=other)).way == other


def test_swinging_soles_are_above_a_threshold_or_beside_it(robot, task, doorway):
    """By the joints' kinematics, at a threshold as high as the leaf's distance from the floor."""
    door = doorway(threshold=0.01)
    motion = plan_passage(robot, replace(task, doorway=door)).walk.motion
    box = door.threshold
    crossed = 0
    for foot in robot.feet.values():
        for joints, base, yaw in zip(
                motion.joints, motion.base, motion.base_yaw.angle, strict=True):
            place, turn = robot.frame_pose(robot.configuration(np.zeros(3), joints), foot.frame)
            heading = np.arctan2(turn[1, 0], turn[0, 0]) + yaw
            across = np.array([np.sin(yaw), np.cos(yaw)])
            y = foot.corners(np.zeros(3), float(heading))[:, 1] + base[1] + across @ place[:2]
            above = base[2] + place[2] - box.center[2] - box.half[2]
            beside = max(y.min() - box.center[1], box.center[1] - y.max()) - box.half[1]
            assert max(above, beside) >= SETTINGS.over_threshold - 0.001
            crossed += beside < 0.0
    assert crossed > 10
