"""The ending `hold`."""

import math
from dataclasses import replace

import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from door_model.motion.dynamics import simulate
from humanoid_motion.errors import JointLimit
from humanoid_motion.leaf import LeafFrame
from humanoid_motion.whole_body import require_joint_limits
from impact_planner.motion.arm_reach import ArmReach
from impact_planner.motion.catch import HoldTask, choices
from impact_planner.motion.hold import Candidate, plan_hold
from impact_planner.task.request import Task

TARGET = math.radians(25.0)


@pytest.fixture(scope="module", params=["hold", "pass"])
def task(robot, known, plan, request):
    """The door to hold, from the end of the plan's phase `post`."""
    joints = plan.phase("post").knots.position[-1]
    q = robot.configuration(np.zeros(3), joints)
    base = plan.left_foot - robot.frame_position(q, robot.feet["left"].frame)
    feet = {"left": plan.left_foot, "right": plan.right_foot}
    wanted = replace(plan.request, ending=request.param)
    whole = Task(robot, known, wanted, plan.settings)
    return HoldTask(whole, plan.hit.placement.hinge, feet, TARGET, joints, base)


@pytest.fixture(scope="module")
def hold(task):
    """The phase `hold` before its check, with its details."""
    found = []
    plan_hold(task, found.append)
    return found[0]


def body(robot, motion, i, frame):
    """Position of a frame at a sample of a motion."""
    return robot.frame_position(robot.configuration(motion.base[i], motion.joints[i]), frame)


def leaf_at(known, hold, hinge, time):
    """The leaf, which closes freely until the hand arrives."""
    if time > hold.catch.reach + 0.1:
        return LeafFrame(hinge, float(hold.catch.angle_at(np.array([time]))[0]))
    swing = simulate(known.door, TARGET, 0.0, 1.0)
    return LeafFrame(hinge, float(np.interp(time, swing.t, swing.theta)))


def test_nothing_touches_the_falling_leaf_before_the_hand_is_there(robot, known, hold, task):
    """Nothing touches the leaf while the arm extends, and only the hand does later."""
    motion = hold.phase.motion
    for i in range(0, len(motion), 5):
        leaf = leaf_at(known, hold, task.hinge, motion.time[i])
        hand = leaf.gap(body(robot, motion, i, robot.config.hand_link)) - robot.hand_radius
        assert hand > (0.01 if motion.time[i] < hold.catch.reach else -1e-3)
        for frame, radius in ((robot.config.contact_link, 0.05), ("RARM_LINK4", 0.04)):
            assert leaf.gap(body(robot, motion, i, frame)) - radius > 0.01


def test_hand_stays_on_its_spot_of_the_leaf(robot, hold, task):
    """After its arrival the hand keeps its distance from the hinge, its height and contact."""
    motion = hold.phase.motion
    for i in np.flatnonzero(motion.time >= hold.catch.reach + 0.02)[::8]:
        angle = float(hold.catch.angle_at(motion.time[i : i + 1])[0])
        leaf = LeafFrame(task.hinge, angle)
        hand = body(robot, motion, i, robot.config.hand_link)
        assert leaf.gap(hand) == pytest.approx(robot.hand_radius, abs=5e-4)
        assert leaf.radius(hand) == pytest.approx(hold.hand.radius, abs=5e-4)
        assert hand[2] == pytest.approx(hold.hand.height, abs=5e-4)


def test_force_is_the_closer_s_torque_over_the_distance(known, hold):
    """The largest force is that of eq. (12) on the hand's path."""
    angles = np.linspace(hold.catch.lowest, hold.catch.final, 50)
    worst = known.door.restoring_torque(angles).max() / hold.hand.radius
    assert hold.force == pytest.approx(worst, rel=1e-3)
    np.testing.assert_allclose(
        np.linalg.norm(hold.load.force[-1]),
        known.door.restoring_torque(hold.catch.final) / hold.hand.radius,
    )
    assert hold.load.force[-1, 1] > 0.0  # points away from the door


def test_the_leaf_ends_where_it_shall(task, hold):
    """It is pushed back to the desired angle, or stays where it was caught for the passage."""
    catch = hold.catch
    if task.task.wanted.ending == "pass":
        assert 0.0 < catch.final == catch.lowest < TARGET
    else:
        assert catch.lowest < catch.final == TARGET
    assert catch.angle_at(np.array([catch.duration]))[0] == pytest.approx(catch.final)


def test_com_leans_against_the_force(robot, hold):
    """The CoM leans towards the door by force times height over weight."""
    motion = hold.phase.motion
    com = [robot.com(robot.configuration(motion.base[i], motion.joints[i])) for i in (0, -1)]
    lean = com[1] - com[0]
    expected = -hold.load.force[-1] * hold.hand.height / (robot.mass * GRAVITY)
    np.testing.assert_allclose(lean[:2], expected[:2], atol=2e-4)
    assert lean[1] < 0.0


def test_a_candidate_that_is_refused_unseen_breaks_a_limit_when_it_is_planned(robot, task):
    """A quick refusal never costs a plan: the whole motion has a too fast joint, too."""
    refused = 0
    reach = ArmReach(robot)
    for catch, hand in choices(task, reach):
        candidate = Candidate(task, reach, catch, hand, lean_share=1.0)
        if candidate.is_hopeless():
            refused += 1
            with pytest.raises(JointLimit, match="would turn at"):
                require_joint_limits(robot, candidate.plan().phase.motion, "hold", share=0.9)
    assert refused
