"""The ending `hold`."""

import math

import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from door_model.motion.dynamics import simulate
from humanoid_motion.errors import JointLimit, PostureUnreachable
from humanoid_motion.whole_body import require_joint_limits
from impact_planner.errors import AngleUnreachable
from impact_planner.hit.leaf import LeafFrame
from impact_planner.motion.arm_reach import ArmReach
from impact_planner.motion.catch import HoldTask, choices
from impact_planner.motion.hold import Candidate, plan_hold
from impact_planner.plan import plan_impact
from impact_planner.task.request import PlanRequest
from impact_planner.task.settings import PlannerSettings

TARGET = math.radians(25.0)


@pytest.fixture(scope="module")
def hinge(plan):
    """x and y of the hinge in odom."""
    return plan.hit.placement.hinge


@pytest.fixture(scope="module")
def task(robot, known, plan, hinge):
    """The door to hold, from the end of the plan's phase `post`."""
    joints = plan.phase("post").knots.position[-1]
    q = robot.configuration(np.zeros(3), joints)
    base = plan.left_foot - robot.frame_position(q, robot.feet["left"].frame)
    feet = {"left": plan.left_foot, "right": plan.right_foot}
    return HoldTask(known.door, known.width, hinge, TARGET, joints, base, feet, 60.0, 0.9, 0.005)


@pytest.fixture(scope="module")
def hold(robot, task):
    """The phase `hold` before its check, with its details."""
    found = []
    plan_hold(robot, task, found.append)
    return found[0]


def body(robot, motion, i, frame):
    """Position of a frame at a sample of a motion."""
    return robot.frame_position(robot.configuration(motion.base[i], motion.joints[i]), frame)


def leaf_at(known, hold, hinge, time):
    """The leaf, which closes freely until the hand arrives."""
    if time > hold.catch.reach + 0.1:
        return LeafFrame(hinge, float(hold.catch.angle_at(np.array([time]), TARGET)[0]))
    swing = simulate(known.door, TARGET, 0.0, 1.0)
    return LeafFrame(hinge, float(np.interp(time, swing.t, swing.theta)))


def test_nothing_touches_the_falling_leaf_before_the_hand_is_there(robot, known, hold, hinge):
    """Nothing touches the leaf while the arm extends, and only the hand does later."""
    motion = hold.phase.motion
    for i in range(0, len(motion), 5):
        leaf = leaf_at(known, hold, hinge, motion.time[i])
        hand = leaf.gap(body(robot, motion, i, robot.config.hand_link)) - robot.hand_radius()
        assert hand > (0.01 if motion.time[i] < hold.catch.reach else -1e-3)
        for frame, radius in ((robot.config.contact_link, 0.05), ("RARM_LINK4", 0.04)):
            assert leaf.gap(body(robot, motion, i, frame)) - radius > 0.01


def test_hand_stays_on_its_spot_of_the_leaf(robot, hold, hinge):
    """After its arrival the hand keeps its distance from the hinge, its height and contact."""
    motion = hold.phase.motion
    for i in np.flatnonzero(motion.time >= hold.catch.reach + 0.02)[::8]:
        angle = float(hold.catch.angle_at(motion.time[i : i + 1], TARGET)[0])
        leaf = LeafFrame(hinge, angle)
        hand = body(robot, motion, i, robot.config.hand_link)
        assert leaf.gap(hand) == pytest.approx(robot.hand_radius(), abs=5e-4)
        assert leaf.radius(hand) == pytest.approx(hold.hand.radius, abs=5e-4)
        assert hand[2] == pytest.approx(hold.hand.height, abs=5e-4)


def test_hand_meets_the_leaf_below_the_target_and_brings_it_there(hold):
    """The leaf is caught below the target, stopped, and pushed to the target."""
    time = hold.phase.motion.time
    angle = hold.catch.angle_at(time[time >= hold.catch.reach], TARGET)
    meeting = hold.catch.angle_at(np.array([hold.catch.reach]), TARGET)
    assert meeting[0] == pytest.approx(hold.catch.angle)
    assert hold.catch.lowest == pytest.approx(angle.min(), abs=1e-4)
    assert hold.catch.lowest < hold.catch.angle < TARGET
    assert angle[-1] == pytest.approx(TARGET)


def test_meeting_speed_is_a_fraction_of_the_leaf_s(known, hold):
    """The hand arrives with 0.5 to 1 times the leaf's speed, in the same direction."""
    swing = simulate(known.door, TARGET, 0.0, hold.catch.reach + 0.1)
    assert 0.5 < hold.catch.speed / swing.omega[-1] < 1.0


def test_force_is_the_closer_s_torque_over_the_distance(known, hold):
    """The largest force is that of eq. (12) on the hand's path."""
    angles = np.linspace(hold.catch.lowest, TARGET, 50)
    worst = known.door.restoring_torque(angles).max() / hold.hand.radius
    assert hold.force == pytest.approx(worst, rel=1e-3)
    np.testing.assert_allclose(
        np.linalg.norm(hold.load.force[-1]),
        known.door.restoring_torque(TARGET) / hold.hand.radius,
    )
    assert hold.load.force[-1, 1] > 0.0  # points away from the door


def test_com_leans_against_the_force(robot, hold):
    """The CoM leans towards the door by force times height over weight."""
    motion = hold.phase.motion
    com = [robot.com(robot.configuration(motion.base[i], motion.joints[i])) for i in (0, -1)]
    lean = com[1] - com[0]
    expected = -hold.load.force[-1] * hold.hand.height / (robot.mass * GRAVITY)
    np.testing.assert_allclose(lean[:2], expected[:2], atol=2e-4)
    assert lean[1] < 0.0


def test_a_leaf_that_the_arm_loses_is_named_by_its_angle(robot, known, monkeypatch):
    """The refusal has the first angle out of reach and the last one within reach."""
    follow = ArmReach.follow

    def loses(*args):
        found = follow(*args)
        found[30:] = np.nan
        return found

    monkeypatch.setattr(ArmReach, "follow", loses)
    with pytest.raises(AngleUnreachable, match="loses the leaf") as caught:
        plan_impact(PlanRequest(TARGET), known, robot)
    assert 0.0 < caught.value.limit < caught.value.value < TARGET


def test_a_door_that_can_be_held_nowhere_says_so(robot, known):
    """A hand that bears no force is refused with a limit of 0, not NaN."""
    with pytest.raises(AngleUnreachable, match="at no angle") as caught:
        plan_impact(PlanRequest(math.radians(8.0), restitution=0.7), known, robot,
                    PlannerSettings(hand_force_limit=0.1))
    assert caught.value.limit == 0.0


def test_a_candidate_that_is_refused_unseen_breaks_a_limit_when_it_is_planned(robot, task):
    """A quick refusal never costs a plan: the whole motion has a too fast joint, too."""
    refused = 0
    reach = ArmReach(robot)
    for catch, hand in choices(robot, reach, task):
        candidate = Candidate(robot, reach, task, catch, hand, lean_share=1.0)
        if candidate.is_hopeless():
            refused += 1
            with pytest.raises(JointLimit, match="would turn at"):
                require_joint_limits(
                    robot, candidate.plan().phase.motion, "hold", share=task.joint_share)
    assert refused


def test_the_error_is_that_of_the_best_candidate_though_it_was_refused_unseen(robot, task):
    """Where no candidate can be executed, the error names the first one's joint and its speed."""
    def check(hold):
        require_joint_limits(robot, hold.phase.motion, "hold", share=task.joint_share)
        raise PostureUnreachable("every other candidate", quantity="clearance [m]")

    reach = ArmReach(robot)
    first = Candidate(robot, reach, task, *next(choices(robot, reach, task)), lean_share=1.0)
    assert first.is_hopeless()
    with pytest.raises(JointLimit) as expected:
        check(first.plan())
    with pytest.raises(JointLimit) as caught:
        plan_hold(robot, task, check)
    assert str(caught.value) == str(expected.value)


@pytest.mark.nightly("plans every candidate of many angles")
@pytest.mark.parametrize("degrees", range(12, 40, 2))
def test_quick_refusals_at_other_angles(robot, known, degrees, monkeypatch):
    """At every angle, what is refused unseen would also be refused after it was planned."""
    hopeless = Candidate.is_hopeless
    wrong = []

    def verified(candidate):
        refused = hopeless(candidate)
        if refused:
            try:
                limit = PlannerSettings().limit_share
                require_joint_limits(
                    robot, candidate.plan().phase.motion, "hold", share=limit)
                wrong.append(candidate)
            except (AngleUnreachable, JointLimit, PostureUnreachable):
                pass
        return refused

    monkeypatch.setattr(Candidate, "is_hopeless", verified)
    plan_impact(PlanRequest(math.radians(degrees)), known, robot)
    assert not wrong
