"""The execution of a walk beside the simulation's own driver, whose joints follow at once."""

import math
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from door_model.door.geometry import Frame, Leaf
from hrp2_description.robot import SIDES
from humanoid_motion.driver_interface import TrajectoryArrays
from hypothesis import given, settings
from hypothesis import strategies as st
from motion_execution.walk.goal import WalkGoal, plan_goal
from motion_execution.walk.walk import Walk
from robot_driver.motion import Outcome
from robot_driver.trajectory_checks import JointLimits
from robot_driver.trajectory_driver import TrajectoryDriver
from walking.errors import WalkInfeasible
from walking.footsteps.footstep import Pose
from walking.passing.doorway import Doorway
from walking.passing.surroundings import Surroundings
from walking.pattern.settings import WalkSettings

TICK = 0.005  # period of the driver [s]
BEGIN = 1.0  # time of the driver's clock at which a walk is sent [s]
WITHIN = 2.0  # time after which a robot that gets no further message is at rest on two feet [s]
BEFORE = 2.8  # the same before the first step, while it stands on two feet all the time [s]
STILL = 0.01  # speed below which a joint counts as at rest [rad/s]


@dataclass
class Rig:
    """A walk and a driver; `reference` has what the driver followed, `sent` what it was sent."""

    robot: object
    walk: Walk
    reference: list = field(default_factory=list)
    sent: list = field(default_factory=list)
    lost: int = -1  # number of the command that never arrives
    stops: int = 0

    def __post_init__(self):
        self.driver = TrajectoryDriver(
            JointLimits.of(self.robot.config), self.walk.plan.knots.position[0])
        self.now = BEGIN
        self.send([self.walk.start(self.now)])

    def send(self, commands):
        for command in commands:
            if command.knots is None:
                self.stops += 1
                self.driver.stop(self.now)
                continue
            knots = command.knots
            self.sent.append(command)
            if len(self.sent) == self.lost + 1:
                continue
            self.driver.accept(TrajectoryArrays(
                self.robot.joint_names, knots.time.tolist(), knots.position.tolist(),
                knots.velocity.tolist(), knots.acceleration.tolist()), command.stamp, self.now)

    def tick(self, heard=True):
        self.now += TICK
        found = self.driver.sample(self.now)
        self.reference.append(found)
        if heard:
            self.send(self.walk.on_joints(self.now, found.position, found.velocity))

    def run(self, until=math.inf, heard=lambda now: True):
        while self.walk.outcome is Outcome.RUNNING and self.now < until:
            self.tick(heard(self.now))
        return self

    def stands(self, position=None):
        """Assert that both soles lie on the floor and no joint turns."""
        found = self.driver.sample(self.now)
        assert np.abs(found.velocity).max() < STILL
        assert_on_two_feet(self.robot, found.position)

    def steady(self):
        """Assert that no speed of a joint jumps: 60 rad/s^2 are more than any walk needs."""
        speed = np.array([each.velocity for each in self.reference])
        assert np.abs(np.diff(speed, axis=0)).max() < 60.0 * TICK


def assert_on_two_feet(robot, position):
    q = robot.configuration(np.zeros(3), position)
    poses = [robot.frame_pose(q, robot.feet[side].frame) for side in SIDES]
    assert abs(poses[0][0][2] - poses[1][0][2]) < 1e-4
    assert all(abs(turn[2, 2] - 1.0) < 1e-6 for _, turn in poses)


@pytest.fixture(scope="module")
def ahead(walk_to):
    """A walk of seven footsteps."""
    plan = walk_to(1.2, 0.0, 0.0)
    assert len(plan.footsteps) >= 6
    return plan


@pytest.fixture
def rig(robot, ahead):
    return Rig(robot, Walk(robot, ahead))


def test_a_walk_that_is_not_disturbed_is_the_planned_one(rig, ahead):
    """The driver's reference is the plan's to 0.1 mrad, and ends where the plan ends."""
    rig.run()
    assert rig.walk.outcome is Outcome.SUCCESS
    assert rig.walk.steps_made(rig.now) == len(ahead.footsteps)
    origin = rig.sent[0].stamp + rig.sent[0].knots.time[0]
    times = BEGIN + TICK * np.arange(1, len(rig.reference) + 1) - origin
    off = np.array([each.position for each in rig.reference]) - ahead.knots.at(times)[0]
    assert np.abs(off).max() < 1e-4


def test_every_trajectory_ends_with_the_robot_standing_on_two_feet(rig):
    """So that silence is safe whenever it begins."""
    rig.run()
    assert len(rig.sent) == len(rig.walk.plan.footsteps) + 1
    for command in rig.sent:
        assert np.abs(command.knots.velocity[-1]).max() < 1e-9
        assert_on_two_feet(rig.robot, command.knots.position[-1])


@settings(max_examples=8)
@given(share=st.floats(0.0, 1.0))
def test_a_silent_walker_leaves_the_robot_at_rest_within_2_s(robot, ahead, share):
    """A crash at any instant of a walk: the driver has all that it needs. Before the first step the
    robot stands on two feet throughout."""
    rig = Rig(robot, Walk(robot, ahead))
    crash = BEGIN + share * (ahead.duration + 0.5)
    rig.run(crash)
    sent, last = rig.walk.steps_sent, len(rig.reference)
    while rig.now < crash + (WITHIN if sent else BEFORE):
        rig.tick(heard=False)
    rig.stands()
    rig.steady()
    if not sent:
        for found in rig.reference[last::20]:
            assert_on_two_feet(robot, found.position)


@settings(max_examples=8)
@given(share=st.floats(0.0, 1.0))
def test_a_stop_finishes_the_step_and_stands_within_2_s(robot, ahead, share):
    rig = Rig(robot, Walk(robot, ahead))
    rig.run(BEGIN + share * ahead.duration)
    at, sent = rig.now, rig.walk.steps_sent
    rig.walk.stop("as requested")
    rig.run(at + (WITHIN if sent else BEFORE))
    rig.stands()
    rig.run()
    assert rig.walk.steps_made(rig.now) == sent
    if sent < len(ahead.footsteps):
        assert (rig.walk.outcome, rig.walk.reason) == (Outcome.STOPPED, "as requested")
    rig.steady()


@settings(max_examples=3)
@given(begin=st.floats(0.5, 5.0), gap=st.floats(0.15, 1.0))
def test_a_walk_whose_messages_pause_stands_and_goes_on_to_its_goal(robot, ahead, begin, gap):
    """No step is sent into a motion that has begun to stop."""
    rig = Rig(robot, Walk(robot, ahead))
    rig.run(heard=lambda now: not BEGIN + begin < now < BEGIN + begin + gap)
    assert rig.walk.outcome is Outcome.SUCCESS
    assert rig.walk.steps_made(rig.now) == len(ahead.footsteps)
    assert rig.walk.stance.middle == pytest.approx(ahead.stance.middle, abs=1e-9)
    rig.stands()
    rig.steady()


@pytest.mark.parametrize("lost", [1, 4, 7])
def test_a_step_whose_motion_comes_too_late_is_made_after_a_rest(robot, ahead, lost):
    """The driver comes to rest before it; the walker sees so, and goes on to the goal."""
    rig = Rig(robot, Walk(robot, ahead), lost=lost).run()
    assert rig.walk.outcome is Outcome.SUCCESS, rig.walk.reason
    assert rig.walk.steps_made(rig.now) == len(ahead.footsteps)
    assert rig.walk.stance.middle == pytest.approx(ahead.stance.middle, abs=1e-9)
    rig.stands()
    rig.steady()


@pytest.mark.parametrize("when", [0.4, 2.6])
def test_new_footsteps_replace_those_that_have_not_begun(robot, ahead, when):
    """The feet that are on their way land where they were to; then the walk goes elsewhere."""
    rig = Rig(robot, Walk(robot, ahead))
    rig.run(BEGIN + when)
    step, state = rig.walk.hold_for_new_footsteps(rig.now)
    assert step >= rig.walk.steps_sent
    goal = WalkGoal(Pose(0.8, 0.5, 0.6))
    side = ahead.footsteps[step - 1].side if step else ""
    plan = plan_goal(robot, state, goal, WalkSettings(), side)
    rig.run(rig.now + 0.3)  # planning takes time
    assert rig.walk.replace(step, plan, rig.now)
    rig.run()
    assert rig.walk.outcome is Outcome.SUCCESS
    assert len(rig.sent) == 1 + step + len(plan.footsteps)
    assert rig.walk.stance.middle == pytest.approx(goal.pose, abs=1e-6)
    assert rig.walk.steps == step + len(plan.footsteps) == rig.walk.steps_made(rig.now)
    rig.stands()
    rig.steady()


def test_new_footsteps_that_come_too_late_are_begun_from_rest(robot, ahead):
    rig = Rig(robot, Walk(robot, ahead))
    rig.run(BEGIN + 2.0)
    step, state = rig.walk.hold_for_new_footsteps(rig.now)
    goal = WalkGoal(Pose(0.8, 0.5, 0.6))
    plan = plan_goal(robot, state, goal, WalkSettings(), ahead.footsteps[step - 1].side)
    rig.run(rig.now + 2.0)
    assert not rig.walk.replace(step, plan, rig.now)
    rig.run(rig.now + 2.0)
    assert rig.walk.outcome is Outcome.RUNNING
    assert rig.walk.resting(rig.now)
    rig.stands()
    rig.send([rig.walk.resume(
        plan_goal(robot, rig.walk.final, goal, WalkSettings()), rig.now)])
    rig.run()
    assert rig.walk.outcome is Outcome.SUCCESS
    assert rig.walk.stance.middle == pytest.approx(goal.pose, abs=1e-6)
    rig.steady()


def test_footsteps_that_could_not_be_replaced_are_gone_on_with(robot, ahead):
    """Whether the decision comes in time or after the robot has come to rest."""
    for wait in (0.2, 4.0):
        rig = Rig(robot, Walk(robot, ahead))
        rig.run(BEGIN + 2.0)
        rig.walk.hold_for_new_footsteps(rig.now)
        rig.run(rig.now + wait)
        rig.walk.go_on()
        rig.run()
        assert rig.walk.outcome is Outcome.SUCCESS
        assert rig.walk.stance.middle == pytest.approx(ahead.stance.middle, abs=1e-9)
        rig.steady()


def test_a_robot_that_does_not_follow_gets_no_further_step(rig):
    """A knee stays where it was; the driver may finish what it has, and the robot stands."""
    rig.run(BEGIN + 2.0)
    position = rig.driver.sample(rig.now).position.copy()
    knee = rig.robot.joint_names.index("RLEG_JOINT3")
    position[knee] -= 0.35
    rig.send(rig.walk.on_joints(rig.now, position, 0.0 * position))
    assert rig.walk.outcome is Outcome.NOT_FOLLOWED
    assert "RLEG_JOINT3 is 0.350 rad" in rig.walk.reason
    assert rig.stops == 0
    assert rig.walk.on_joints(rig.now + TICK, position, 0.0 * position) == []
    for _ in range(round(WITHIN / TICK)):
        rig.tick()
    rig.stands()


def test_a_driver_is_not_blamed_for_the_joints_of_a_robot_that_falls(rig):
    """A joint is off while the trunk leans: the robot was pushed. Upright again, it is judged."""
    rig.run(BEGIN + 2.0)
    position = rig.driver.sample(rig.now).position.copy()
    position[rig.robot.joint_names.index("LLEG_JOINT3")] += 0.35
    rig.send(rig.walk.on_imu(rig.now, np.radians(6.0), np.zeros(3)))
    rig.send(rig.walk.on_joints(rig.now, position, 0.0 * position))
    assert rig.walk.outcome is Outcome.RUNNING
    rig.send(rig.walk.on_imu(rig.now, np.radians(1.0), np.zeros(3)))
    rig.send(rig.walk.on_joints(rig.now, position, 0.0 * position))
    assert rig.walk.outcome is Outcome.NOT_FOLLOWED


def test_a_fall_stops_the_driver_and_says_the_tilt(rig):
    rig.run(BEGIN + 2.0)
    assert rig.walk.on_imu(rig.now, np.radians(29.0), np.zeros(3)) == []
    rig.send(rig.walk.on_imu(rig.now, np.radians(31.0), np.zeros(3)))
    assert rig.walk.outcome is Outcome.FELL
    assert "31.0 deg" in rig.walk.reason
    assert rig.stops == 1


def test_a_lag_is_part_of_the_present(rig, ahead):
    """A message that took longer than the time before a step sends no step."""
    rig.run(BEGIN + 1.45)
    assert rig.walk.steps_sent == 0
    rig.walk.lag = 0.3
    boundary = rig.sent[0].stamp + rig.sent[0].knots.time[0] + ahead.begin_of(0)
    rig.run(boundary + 0.2)
    assert rig.walk.steps_sent == 0


def test_a_leaf_that_moves_into_the_way_ends_the_walk_standing_before_it(robot, ahead):
    """It would have led past the leaf's free edge; the reason says where the leaf is."""
    doorway = Doorway(np.zeros(2), Leaf(50.0, 0.9, 2.0, 0.04), Frame(0.91, 0.10, 0.14))
    # From the far side, along the open leaf, 0.2 m beyond where its edge passes.
    around = Surroundings(doorway, Pose(0.9, 0.75, 0.0), math.radians(5.0), (-0.2, 0.2, -0.4, 0.4))
    leaf = [around]
    rig = Rig(robot, Walk(robot, ahead, around=lambda: leaf[0]))
    around.require_way([phase.stance.middle for phase in ahead.schedule.phases])
    rig.run(until=BEGIN + 2.5)
    leaf[0] = replace(around, angle=math.radians(60.0))
    assert rig.walk.on_door(rig.now, leaf[0].angle, 1.0) == []
    rig.run()
    assert rig.walk.outcome is Outcome.STOPPED
    assert "the leaf, which stands open by 60 deg, is in the way" in rig.walk.reason
    assert 0 < rig.walk.steps_made(rig.now) < len(ahead.footsteps)
    rig.stands()


def test_legs_from_which_no_walk_begins_are_told_with_the_way_out(robot, ahead):
    """As those of a robot that was stopped in the step of a hit."""
    state = Walk(robot, ahead).final
    high = replace(state, waist_height=state.waist_height + 0.15)
    with pytest.raises(WalkInfeasible, match=r"sim/reset.*hip and ankle would be .* m apart"):
        plan_goal(robot, high, WalkGoal(Pose(2.0, 0.0, 0.0)), WalkSettings())
