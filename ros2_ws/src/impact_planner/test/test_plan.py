"""The whole pipeline: consistent numbers, continuous phases and refusals."""

import dataclasses
import math
import multiprocessing
from copy import copy, deepcopy
from operator import attrgetter

import numpy as np
import pytest
from hrp2_description.robot import SIDES
from humanoid_motion.errors import PostureUnreachable
from humanoid_motion.numerical_leg import NumericalLeg
from humanoid_motion.robot_model import RobotModel
from impact_planner.errors import (
    AngleUnreachable,
    InvalidRequest,
    SpeedUnreachable,
)
from impact_planner.plan import plan_impact
from impact_planner.task.request import PlanRequest
from impact_planner.task.settings import PlannerSettings

ORDER = ["prepare", "shift", "step", "back", "cam", "post", "hold"]
TARGET = math.radians(25.0)


def test_the_papers_door(plan):
    """25 deg need w' = 0.635 rad/s; rubber and friction make m_re exceed eq. (3)."""
    assert plan.omega_door == pytest.approx(0.635, abs=1e-3)
    assert plan.effective_mass == pytest.approx(54.5, abs=1.0)
    assert plan.v_rb == pytest.approx(0.417, abs=0.006)
    assert plan.v_rb_post == pytest.approx(0.062, abs=0.01)
    assert plan.apparent_restitution == pytest.approx(0.47, abs=0.02)
    assert plan.contact_duration == pytest.approx(0.018, abs=1e-3)
    assert 45.0 < plan.effective_mass_planar < 48.0
    assert plan.l_b == pytest.approx(0.42, abs=1e-6)
    assert plan.hit.stance.step == pytest.approx(0.20, abs=1e-4)


def test_robot_door_and_plans_can_be_copied_and_sent_to_another_process(robot, known, plan, arc):
    """Also their configurations; plans of walks, too."""
    parts = ((robot, "upper"), (robot.config, "half_sitting"), (known, "door"), (plan, "v_rb"),
             (arc, "duration"))
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        for thing, part in parts:
            get = attrgetter(part)
            for same in (pool.apply(get, (thing,)), get(copy(thing)), get(deepcopy(thing))):
                np.testing.assert_equal(same, get(thing))


def test_the_papers_speeds_are_those_of_eq_3_s_mass(robot, known, plan):
    """With rigid joints, on soles that give, on a smooth leaf: v_rB about 0.45 m/s."""
    hard = RobotModel(dataclasses.replace(robot.config, drives=None, brace=None, sole_rubber=None))
    smooth = plan_impact(
        PlanRequest(TARGET), known, hard, PlannerSettings(leaf_friction=0.0))
    assert smooth.effective_mass == pytest.approx(plan.effective_mass_planar, rel=5e-3)
    assert smooth.v_rb == pytest.approx(0.45, abs=0.03)
    assert smooth.v_rb_post == pytest.approx(0.04, abs=0.02)


def test_soles_keep_their_places_on_the_floor_except_in_the_step(robot, plan):
    """Along the spline, relative to the left sole; the step lifts the right foot 30 to 40 mm."""
    before, placed = -0.19, plan.right_foot[1] - plan.left_foot[1]
    for phase in plan.phases:
        way = []
        for joints in phase.knots.at(np.linspace(0.0, phase.knots.time[-1], 60))[0]:
            q = robot.configuration(np.zeros(3), joints)
            left, right = (robot.frame_position(q, robot.feet[side].frame) for side in SIDES)
            way.append(right - left)
        if phase.name == "step":
            heights = np.array(way)[:, 2]
            assert heights.min() > -2e-4
            assert 0.03 < heights.max() < 0.04
            continue
        there = before if phase.name in ("prepare", "shift") else placed
        np.testing.assert_allclose(way, np.tile([0.0, there, 0.0], (60, 1)), atol=2e-4)


def test_legs_that_are_solved_numerically_give_the_same_plan(robot, known, plan):
    """Within a microradian."""
    other = RobotModel(robot.config)
    other.legs = {side: NumericalLeg(side, other.model, names, robot.config.half_sitting[
        robot.leg_columns[side]]) for side, names in robot.config.legs.items()}
    again = plan_impact(PlanRequest(TARGET), known, other)
    assert again.v_rb == pytest.approx(plan.v_rb, abs=1e-7)
    for one, two in zip(plan.all_phases, again.all_phases, strict=True):
        times = np.linspace(0.0, one.knots.time[-1], 300)
        np.testing.assert_allclose(two.knots.at(times)[0], one.knots.at(times)[0], atol=1e-6)


def test_other_numbers_of_the_request_are_used(robot, known, plan):
    """A lighter robot and a duller leaf need more speed, a door elsewhere another step."""
    light = plan_impact(PlanRequest(TARGET, effective_mass=50.0), known, robot)
    assert light.effective_mass == 50.0 < plan.effective_mass
    assert light.v_rb > plan.v_rb
    livelier = plan_impact(PlanRequest(TARGET, restitution=0.7), known, robot)
    assert livelier.restitution == 0.7
    assert livelier.v_rb < plan.v_rb
    nearer = plan_impact(PlanRequest(TARGET, door_distance=0.69), known, robot)
    assert nearer.hit.stance.step < plan.hit.stance.step
    assert nearer.contact_point[1] == pytest.approx(-0.69, abs=1e-4)


def test_the_retreat_ends_where_the_run_up_began_clear_of_the_falling_door(robot, known):
    """The retreat of Fig. 12 (f) ends at rest, with the leaf more than 10 cm away."""
    plan = plan_impact(PlanRequest(TARGET, ending="retreat"), known, robot)
    assert [phase.name for phase in plan.phases] == [*ORDER[:-1], "retreat"]
    retreat = plan.phase("retreat")
    assert retreat.com_samples[-1, 1] == pytest.approx(plan.hit.run_up.y_start, abs=1e-6)
    assert not np.any(retreat.knots.velocity[[0, -1]])
    assert retreat.clearances[1].distance > 0.1


def test_a_doorway_so_low_and_deep_that_the_head_meets_it_is_refused(robot, known):
    """The robot plans with a low leaf, but not below a wall of 0.6 m in front of it."""
    leaf, frame = known.frame
    low = dataclasses.replace(leaf, height=1.3)
    plans = [dataclasses.replace(known, top=low.top, frame=(low, dataclasses.replace(
        frame, depth=depth, wall_thickness=depth + 0.04))) for depth in (0.1, 0.6)]
    assert all(phase.clearances[2].distance >= robot.config.clearance
               for phase in plan_impact(PlanRequest(TARGET), plans[0], robot).phases)
    with pytest.raises(PostureUnreachable, match=r"HEAD_LINK1.*lintel"):
        plan_impact(PlanRequest(TARGET), plans[1], robot)


@pytest.mark.parametrize(("field", "value"), [
    ("desired_opening_angle", math.nan), ("restitution", 1.01), ("run_up", "sprint")])
def test_each_bad_field_is_named(robot, known, field, value):
    with pytest.raises(InvalidRequest, match=field):
        plan_impact(dataclasses.replace(PlanRequest(TARGET), **{field: value}), known, robot)


@pytest.mark.parametrize(("changes", "error"), [
    ({"desired_opening_angle": math.radians(170.0)}, AngleUnreachable),
    ({"desired_opening_angle": math.radians(60.0)}, SpeedUnreachable),
    ({"l_b": 1.2}, PostureUnreachable)])
def test_what_is_out_of_reach_is_refused_with_value_and_limit(robot, known, changes, error):
    """A large angle, a fast hit and a far l_B."""
    with pytest.raises(error) as caught:
        plan_impact(dataclasses.replace(PlanRequest(TARGET), **changes), known, robot)
    assert caught.value.value > np.max(caught.value.limit) > 0.4


def test_a_door_that_stands_far_away_is_met_with_the_com_further_out(robot, known, plan):
    """The legs reach it there; the reserve of a missed contact is smaller, and the plan says so."""
    far = plan_impact(PlanRequest(TARGET, door_distance=0.755), known, robot)
    inside = [robot.feet["right"].corners(each.right_foot)[:, 1].max()
              - each.hit.stance.posture.com[1] for each in (plan, far)]
    assert inside[0] == pytest.approx(-0.03, abs=1e-6)
    assert inside[1] > -0.02
    assert far.missed_margin < 0.03 < plan.missed_margin
    assert any("may fall" in warning for warning in far.warnings)


@pytest.mark.parametrize("distance", [0.5, 3.0])
def test_a_door_out_of_reach_is_refused_with_the_range_that_is_not(robot, known, distance):
    with pytest.raises(PostureUnreachable, match="door must stand") as caught:
        plan_impact(PlanRequest(TARGET, door_distance=distance), known, robot)
    near, far = caught.value.limit
    assert near < far
    assert not near <= caught.value.value <= far


def test_a_door_that_falls_shut_before_the_arm_comes_cannot_be_held(robot, known):
    """For a small angle, the limit is the nearest angle that can be held."""
    with pytest.raises(AngleUnreachable, match="it can from about") as caught:
        plan_impact(PlanRequest(math.radians(5.0)), known, robot)
    assert math.radians(5.0) < caught.value.limit < TARGET
    plan_impact(PlanRequest(caught.value.limit), known, robot)


def test_a_door_that_falls_shut_on_the_robot_is_refused(robot, known):
    """At 2 deg the leaf comes too near for a retreat, which a cancel needs with any ending."""
    with pytest.raises(PostureUnreachable, match="RARM_LINK3") as caught:
        plan_impact(PlanRequest(math.radians(2.0)), known, robot)
    assert caught.value.value < caught.value.limit
