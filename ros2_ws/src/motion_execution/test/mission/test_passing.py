"""What a mission does before a door: whom it asks, what it refuses, and how it ends.

The planner answers with one plan; a hit or a walk takes the robot at once to where it ends, a walk
not exactly. Reach and passage are real, beside a driver that follows exactly.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from door_impact_common.errors import DoorImpactError
from humanoid_motion.leaf import LeafFrame
from motion_execution.mission.mission import PLAN_PASSAGE, WALK
from motion_execution.mission.order import Order
from motion_execution.mission.ways import Wanted
from motion_execution.ros.passage_messages import plan_message
from motion_execution.walk.goal import WalkGoal
from played_world import SURVEY, TICK, World
from robot_driver.motion import Outcome
from scipy.optimize import brentq
from walking.footsteps.footstep import ORIGIN, Pose
from walking.passing.approach import hit_start
from walking.passing.felt import hand_place


@pytest.fixture(scope="module")
def pass_plan(robot, known):
    """A hit whose leaf stays where it is caught."""
    from impact_planner.plan import plan_impact
    from impact_planner.task.request import PlanRequest
    return plan_impact(PlanRequest(math.radians(25.0), ending="pass"), known, robot)


@pytest.fixture
def world(request, robot, task, pass_plan):
    return World(robot, task, pass_plan, getattr(request, "param", "paper"))


def refused(world, **wanted):
    """Reason and sentence with which a passage is refused or ends."""
    with pytest.raises(DoorImpactError) as error:
        world.go(**wanted)
    return error.value.reason, str(error.value)


def test_hit_and_passage_follow_each_other(world):
    """The hand yields from the passage's begin to the release."""
    passed = world.go(probe="on", speed_scale=0.5)
    passage, way = passed.passage, passed.way
    assert passage.outcome is Outcome.SUCCESS, passed.message
    assert world.hits == [("on", 0.5, False)]
    (request,) = world.requests
    assert (request.ending, request.angle) == ("pass", pytest.approx(math.radians(25.0)))
    assert world.phases == ["plan", "push", "walk", "square_up"]  # the hit takes no time
    assert passage.steps_made(world.time) == len(way.passage.walk.footsteps)
    assert passage.cleared(world.time) + TICK > passed.contact_time + way.passage.clear
    assert passage.watch.largest_force == pytest.approx(12.0)
    assert passage.watch.largest_error < math.radians(1.0)
    steps = [each.step for each in world.feedback]
    assert steps == sorted(steps)
    short, whole = (plan_message(way, 1, Time(), trajectories=each) for each in (False, True))
    assert (len(short.times), len(short.footsteps), short.clear_time) == (0, 0, way.passage.clear)
    assert len(whole.times) == len(whole.leaf_angle) == len(whole.hand_radius) > 100
    assert world.compliance == [(400.0, 400.0, 10.0), ()]
    assert all(each.clearance > 0.0 for each in world.feedback if each.phase == "walk")
    last = way.hold.in_odom(way.passage.walk.footsteps)[-1]
    assert last.y < world.task.doorway.far_face


def test_nothing_moves_where_the_door_cannot_be_passed(world):
    """No other hit widens an opening; where it would leave the robot elsewhere, it is tried."""
    reason, text = refused(world, leaf_angle=math.radians(30.0))
    assert reason == "passage_infeasible"
    assert "between the leaf at 30 deg and the jamb" in text
    assert len(world.requests) == 1
    world.requests.clear()
    world.task = replace(world.task, angle=world.task.angle + math.radians(8.0))
    assert refused(world)[0] == "passage_infeasible"  # the hand would not be there
    assert [(round(math.degrees(each.angle)), each.ending) for each in world.requests[:3]] == [
        (25, "pass"), (30, "pass"), (35, "pass")]
    assert refused(world, hit_angle=math.nan)[0] == "invalid_goal"
    assert refused(world, opening="kick")[0] == "invalid_goal"
    world.yields = False
    reason, text = refused(world)
    assert (reason, "hand_stiffness" in text) == ("not_ready", True)
    assert (world.hits, world.followed) == ([], None)


def test_a_stop_ends_the_hit_and_in_the_passage_finishes_the_step(world):
    world.hold = lambda: False
    routine, order, _ = world.begin()
    world.until(lambda: world.hits)
    order.stop()
    world.until(lambda: routine.done)
    with pytest.raises(DoorImpactError) as error:
        routine.result()
    assert (error.value.reason, world.followed) == ("stopped", None)
    world.hold = None
    routine, order, passed = world.begin()
    world.phase("push")
    step = world.feedback[-1].step
    assert "finishes its step" in world.mission.stop()
    world.until(lambda: routine.done)
    assert passed.passage.outcome is Outcome.STOPPED
    assert step - 1 <= passed.passage.steps_made(world.time) <= step + 1
    assert math.isnan(passed.passage.cleared(world.time))
    assert world.time > world.followed.stamp + world.followed.knots.time[-1]
    assert world.compliance[-1] == ()


def test_a_passage_that_was_stopped_goes_on_from_the_held_leaf(world):
    """Without another hit; a hand that does not hold the leaf is refused."""
    routine, order, passed = world.begin()
    world.phase("walk")
    order.stop()
    world.until(lambda: routine.done)
    assert passed.passage.outcome is Outcome.STOPPED
    hold = world.mission._passing._left.hold
    world.stance = hold.stance
    place = hand_place(world.robot, hold.joints, replace(world.task, stance=hold.stance))
    world.angle += 0.5
    assert "does not hold the leaf" in refused(world)[1]
    world.angle = brentq(lambda angle: LeafFrame(world.task.doorway.hinge, angle).gap(place)
                         - world.robot.hand_radius, world.angle - 1.0, world.angle)
    passed = world.go()
    assert passed.passage.outcome is Outcome.SUCCESS
    assert (passed.way.opening.way, len(world.hits)) == ("", 1)
    last = passed.way.hold.in_odom(passed.way.passage.walk.footsteps)[-1]
    assert last.y < world.task.doorway.far_face


def test_a_lost_leaf_ends_the_passage_standing_where_the_next_goal_can_go_on(world):
    world.off = lambda since: math.radians(20.0) * (since > 3.0)
    routine, _, passed = world.begin()
    world.until(lambda: routine.done)
    assert passed.passage.outcome is Outcome.LEAF_LOST, passed.message
    assert "the leaf is lost" in passed.message
    assert world.mission._passing._left.passage is passed.passage.passage


def test_a_robot_elsewhere_walks_up_and_passes_from_where_it_really_stands(world):
    """Hit and passage are planned anew there."""
    world.place = Pose(-1.2, 1.6, 0.5)
    passed = world.go(probe="off")
    assert passed.passage.outcome is Outcome.SUCCESS, passed.message
    assert world.walks == [pytest.approx(ORIGIN)]
    first, seen = world.requests
    assert (first.door_distance, first.l_b) == (-1.0, -1.0)
    b = world.place.moved(world.task.doorway.hinge[0] + 0.4, -seen.door_distance)
    assert b[:2] == pytest.approx((SURVEY.x + seen.l_b, SURVEY.y), abs=1e-3)
    assert world.hits == [("off", 1.0, False)]


def test_a_door_that_is_told_of_is_touched_and_passed_where_it_is(world):
    world.told = Pose(3.0, 1.0, 2.0)
    start = hit_start(world.told, SURVEY)
    world.place = start.moved(0.004, 0.0)  # nobody walks so far
    passed = world.go(dry_run=True)
    assert world.hits == [("on", 1.0, True)]
    assert world.walks == []
    assert world.requests[-1].l_b == pytest.approx(0.4 + 0.004, abs=2e-3)
    last = passed.way.hold.in_odom(passed.way.passage.walk.footsteps)[-1]
    assert Pose(last.x, last.y, last.yaw).seen_from(start).y < world.task.doorway.far_face


def test_without_a_way_to_the_door_nothing_moves(world):
    """And no hit follows a walk that has not arrived, or was stopped."""
    world.place = Pose(-1.2, 1.6, 0.5)
    assert refused(world, walk_up=False)[0] == "not_reached"
    for ends, wanted in ((Outcome.STOPPED, "not_reached"), (Outcome.FELL, "fell")):
        world.walk_ends = ends
        assert refused(world)[0] == wanted
    world.hold = lambda: False
    routine, order, _ = world.begin()
    world.until(lambda: len(world.walks) == 3)
    order.stop()
    world.until(lambda: routine.done)
    with pytest.raises(DoorImpactError) as error:
        routine.result()
    assert error.value.reason == "stopped"
    world.told = Pose(0.0, 3.0, 0.0)
    assert refused(world)[0] == "bad_door_pose"
    assert (world.hits, world.followed, len(world.walks)) == ([], None, 3)


def test_a_heavy_door_is_pushed_only_if_somebody_wants_it(world):
    """The plan says how the leaf is opened, and why."""
    for wanted, way, reason in (("", "hit", "22 N are allowed"), ("push", "push", "100 N")):
        routine = world.mission.run(world.mission.plan_passage(
            Wanted(opening=wanted), Order(PLAN_PASSAGE)))
        world.until(lambda routine=routine: routine.done)
        opening = routine.result().opening
        assert opening.way == way
        assert reason in opening.reason


@pytest.mark.parametrize("world", ["light"], indirect=True)
def test_a_light_door_is_pushed_from_closed(world):
    """Nobody hits it; the passage begins where the hand has met the leaf, with the leaf closed."""
    world.go(dry_run=True)
    assert world.followed is None
    passed = world.go()
    assert passed.passage.outcome is Outcome.SUCCESS, passed.message
    assert world.hits == world.requests == []
    assert [each for each in world.phases if each != "plan"] == [
        "reach", "push", "walk", "square_up"]
    assert float(passed.way.passage.push.at(np.zeros(1))[0]) == 0.0
    assert math.isnan(passed.contact_time)
    assert passed.passage.cleared(world.time) - passed.began > (
        passed.way.passage.clear + world.touches)


@pytest.mark.parametrize("world", ["light"], indirect=True)
def test_a_hand_that_does_not_meet_the_leaf_or_is_stopped_before_stands(world):
    """The hand has not gone on when it was stopped."""
    world.touches = math.inf
    assert refused(world)[0] == "no_contact"
    way = world.followed.knots.time[-1]
    world.position, world.followed, world.feedback = world.robot.config.half_sitting, None, []
    routine, order, _ = world.begin()
    world.phase("reach")
    order.stop()
    world.until(lambda: routine.done)
    with pytest.raises(DoorImpactError) as error:
        routine.result()
    assert error.value.reason == "stopped"
    assert world.followed.knots.time[-1] < way
    assert "push" not in world.phases


def test_one_order_at_a_time_moves_the_robot_and_a_refused_one_leaves_it_alone(world):
    """While a passage goes on, nobody walks, and no second passage begins."""
    routine, _, passed = world.begin()
    world.phase("push")
    for other in (world.mission.walk(WalkGoal(Pose(1.0, 0.0, 0.0)), Order(WALK)),
                  world.mission.plan_passage(Wanted(), Order(PLAN_PASSAGE)),
                  world.mission.pass_door(Wanted(), Order("walk_through_door"), passed)):
        tried = world.mission.run(other)
        assert tried.done
        with pytest.raises(DoorImpactError, match="goes through the door"):
            tried.result()
    world.until(lambda: routine.done)
    assert passed.passage.outcome is Outcome.SUCCESS
