"""The whole pipeline: consistent numbers, continuous phases and refusals."""

import dataclasses
import math

import numpy as np
import pytest
from door_model.identification.parameters import PARAMETERS
from door_model.motion.dynamics import peak
from hrp2_description.robot import SIDES
from humanoid_motion.errors import PostureUnreachable
from humanoid_motion.robot_model import RobotModel
from impact_planner.errors import (
    AngleUnreachable,
    InvalidRequest,
    SpeedUnreachable,
)
from impact_planner.hit.door_prediction import predict
from impact_planner.hit.leaf import LeafFrame
from impact_planner.plan import placement_for_step, plan_impact
from impact_planner.task.request import PlanRequest
from impact_planner.task.settings import PlannerSettings

ORDER = ["prepare", "shift", "step", "back", "cam", "post", "hold"]
TARGET = math.radians(25.0)


def test_the_papers_door(plan):
    """25 deg need w' = 0.635 rad/s; rubber and friction make m_re exceed eq. (3)."""
    assert plan.omega_door == pytest.approx(0.635, abs=1e-3)
    assert plan.effective_mass == pytest.approx(55.8, abs=1.0)
    assert plan.v_rb == pytest.approx(0.417, abs=0.006)
    assert plan.v_rb_post == pytest.approx(0.072, abs=0.01)
    assert plan.apparent_restitution == pytest.approx(0.47, abs=0.02)
    assert plan.contact_duration == pytest.approx(0.018, abs=1e-3)
    assert 45.0 < plan.effective_mass_planar < 48.0
    assert plan.l_b == pytest.approx(0.42, abs=1e-6)
    assert plan.hit.stance.step == pytest.approx(0.20, abs=1e-4)


def test_the_papers_speeds_are_those_of_eq_3_s_mass(robot, known, plan):
    """With rigid joints, on soles that give, on a smooth leaf: v_rB about 0.45 m/s."""
    hard = RobotModel(dataclasses.replace(robot.config, drives=None, brace=None, sole_rubber=None))
    smooth = plan_impact(
        PlanRequest(TARGET), known, hard, PlannerSettings(leaf_friction=0.0))
    assert smooth.effective_mass == pytest.approx(plan.effective_mass_planar, rel=5e-3)
    assert smooth.v_rb == pytest.approx(0.45, abs=0.03)
    assert smooth.v_rb_post == pytest.approx(0.04, abs=0.02)


def test_the_speeds_follow_from_the_mass_by_eq_2_and_restitution(known, plan):
    """v_rB = (w' (I_A + m l^2) + braking) / ((1 + e) m l) holds for the planned mass."""
    m, l_b, i_a = plan.effective_mass, plan.l_b, known.door.i_a
    v_rb = (plan.omega_door * (i_a + m * l_b**2) + plan.braking) / (
        (1.0 + plan.apparent_restitution) * m * l_b)
    assert plan.v_rb == pytest.approx(v_rb, rel=1e-9)
    assert plan.v_rb_post == pytest.approx(
        plan.omega_door * l_b - plan.apparent_restitution * v_rb, rel=1e-9)


def test_carrying_soles_stay_on_the_floor_along_the_spline(robot, plan):
    """Relative to the left sole, the right sole keeps its place except during the step."""
    start, placed = -0.19, plan.right_foot[1] - plan.left_foot[1]
    expected = {"prepare": start, "shift": start} | dict.fromkeys(ORDER[3:], placed)
    for phase in plan.phases:
        if phase.name not in expected:
            continue
        for joints in phase.knots.at(np.linspace(0.0, phase.knots.time[-1], 40))[0]:
            q = robot.configuration(np.zeros(3), joints)
            soles = {side: robot.frame_position(q, robot.feet[side].frame) for side in SIDES}
            np.testing.assert_allclose(
                soles["right"] - soles["left"], [0.0, expected[phase.name], 0.0], atol=2e-4
            )


def test_step_lifts_the_foot_and_sets_it_down_where_it_belongs(robot, plan):
    """The foot rises by 30 to 40 mm and never goes below the floor."""
    heights = []
    for joints in plan.phase("step").knots.at(np.linspace(0.0, 1.2, 100))[0]:
        q = robot.configuration(np.zeros(3), joints)
        left, right = (robot.frame_position(q, robot.feet[side].frame) for side in SIDES)
        heights.append(right[2] - left[2])
    assert min(heights) > -2e-4
    assert 0.03 < max(heights) < 0.04


def test_hand_ends_on_the_leaf_at_the_target(robot, plan):
    """The hand touches the face at the desired angle, far from the hinge; the elbow is clear."""
    joints = plan.phase("hold").knots.position[-1]
    q = robot.configuration(np.zeros(3), joints)
    shift = plan.left_foot - robot.frame_position(q, robot.feet["left"].frame)
    leaf = LeafFrame(plan.hit.placement.hinge, TARGET)
    hand = robot.frame_position(q, robot.config.hand_link) + shift
    assert leaf.gap(hand) == pytest.approx(robot.hand_radius(), abs=1e-3)
    assert 0.7 < leaf.radius(hand) < 0.896
    assert leaf.gap(robot.contact_position(q) + shift) > robot.config.contact_radius + 0.01


def test_other_numbers_of_the_request_are_used(robot, known, plan):
    """effective_mass, restitution, l_b and door_distance of the request are used."""
    light = plan_impact(PlanRequest(TARGET, effective_mass=50.0), known, robot)
    assert light.effective_mass == 50.0 < plan.effective_mass
    assert light.v_rb > plan.v_rb
    livelier = plan_impact(PlanRequest(TARGET, restitution=0.7), known, robot)
    assert livelier.restitution == 0.7
    assert livelier.v_rb < plan.v_rb
    further = plan_impact(PlanRequest(TARGET, l_b=0.5), known, robot)
    assert further.l_b == pytest.approx(0.5, abs=1e-6)
    assert further.hit.placement.hinge_x == pytest.approx(
        plan.hit.placement.hinge_x - 0.08, abs=2e-3)
    nearer = plan_impact(PlanRequest(TARGET, door_distance=0.72), known, robot)
    assert nearer.hit.stance.step < plan.hit.stance.step
    assert nearer.contact_point[1] == pytest.approx(-0.72, abs=1e-4)


def test_a_door_that_is_ajar_is_hit_on_its_open_leaf(robot, known):
    """B lies on the leaf at the initial angle, and w' is lower than from the closed door."""
    ajar = plan_impact(PlanRequest(TARGET, initial_angle=math.radians(3.0)), known, robot)
    leaf = LeafFrame(ajar.hit.placement.hinge, math.radians(3.0))
    assert leaf.gap(ajar.contact_point) == pytest.approx(0.0, abs=1e-4)
    assert leaf.radius(ajar.contact_point) == pytest.approx(ajar.l_b, abs=1e-4)
    assert ajar.omega_door < predict(known, TARGET, 0.0).omega


@pytest.mark.parametrize("angle", [math.nan, 0.0])
def test_what_is_no_angle_is_an_invalid_request(robot, known, angle):
    """An angle that is not finite and positive is an invalid request."""
    with pytest.raises(InvalidRequest, match="desired_opening_angle"):
        plan_impact(PlanRequest(angle), known, robot)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("initial_angle", 0.5),
        ("restitution", 1.01),
        ("effective_mass", math.inf),
        ("run_up", "sprint"),
    ],
)
def test_each_bad_field_is_named(robot, known, field, value):
    """A refusal names the field that is wrong."""
    with pytest.raises(InvalidRequest, match=field):
        plan_impact(PlanRequest(TARGET, **{field: value}), known, robot)


def test_the_retreat_ends_where_the_run_up_began_clear_of_the_falling_door(robot, known):
    """The retreat of Fig. 12 (f) ends at rest, with the leaf more than 10 cm away."""
    plan = plan_impact(PlanRequest(TARGET, ending="retreat"), known, robot)
    assert [phase.name for phase in plan.phases] == [*ORDER[:-1], "retreat"]
    retreat = plan.phase("retreat")
    assert retreat.com_samples[-1, 1] == pytest.approx(plan.hit.run_up.y_start, abs=1e-6)
    assert not np.any(retreat.knots.velocity[[0, -1]])
    assert retreat.clearances[1].distance > 0.1


def test_refusals_carry_value_and_limit(robot, known):
    """Refusals of a large angle, a fast hit, a far door and a far l_B carry value and limit."""
    with pytest.raises(AngleUnreachable, match="linkage") as angle:
        plan_impact(PlanRequest(math.radians(170.0)), known, robot)
    assert angle.value.limit < math.radians(170.0)
    with pytest.raises(SpeedUnreachable) as speed:
        plan_impact(PlanRequest(math.radians(60.0)), known, robot)
    assert speed.value.value > speed.value.limit > 0.4
    with pytest.raises(PostureUnreachable) as place:
        plan_impact(PlanRequest(TARGET, door_distance=1.5), known, robot)
    assert place.value.limit[0] < place.value.limit[1] < 1.5
    with pytest.raises(PostureUnreachable, match="free edge"):
        plan_impact(PlanRequest(TARGET, l_b=1.2), known, robot)


def test_a_door_that_falls_shut_before_the_arm_comes_cannot_be_held(robot, known):
    """For a small angle, the limit is the nearest angle that can be held."""
    with pytest.raises(AngleUnreachable, match="it can from about") as caught:
        plan_impact(PlanRequest(math.radians(5.0)), known, robot)
    assert math.radians(5.0) < caught.value.limit < TARGET
    plan_impact(PlanRequest(caught.value.limit), known, robot)


def test_a_door_that_falls_shut_on_the_robot_is_refused(robot, known):
    """At 3 deg the leaf comes too near for a retreat, which a cancel needs with any ending."""
    with pytest.raises(PostureUnreachable, match="RARM_LINK3") as caught:
        plan_impact(PlanRequest(math.radians(3.0)), known, robot)
    assert caught.value.value < caught.value.limit


def test_uncertain_parameters_spread_the_peak(known):
    """Standard deviations agree with a Monte Carlo, and are 0 for an exact door."""
    exact = predict(known, TARGET, 0.0)
    assert exact.peak_angle_std == exact.peak_time_std == 0.0
    door = known.door
    std = np.array([0.02 * door.i_a, 0.1 * door.c_c, 0.05 * door.k_c, 0.03 * door.tau_c0_prime])
    covariance = np.diag(std**2)
    covariance[2, 3] = covariance[3, 2] = -0.8 * std[2] * std[3]
    unsure = dataclasses.replace(known, parameters=PARAMETERS, covariance=covariance)
    found = predict(unsure, TARGET, 0.0)
    rng = np.random.default_rng(1)
    mean = [door.i_a, door.c_c, door.k_c, door.tau_c0_prime]
    summits = [
        peak(dataclasses.replace(door, i_a=a, c_c=c, k_c=k, tau_c0_prime=t), 0.0, found.omega)
        for a, c, k, t in rng.multivariate_normal(mean, covariance, 300)
    ]
    assert found.peak_angle_std == pytest.approx(np.std([s.angle for s in summits]), rel=0.15)
    assert found.peak_time_std == pytest.approx(np.std([s.time for s in summits]), rel=0.15)


def test_nominal_placement_asks_for_the_nominal_step(robot, known, plan):
    """A plan at the nominal place and a plan without a place are the same."""
    nominal = placement_for_step(robot, PlannerSettings(), robot.config.step.nominal)
    placed = plan_impact(
        PlanRequest(TARGET),
        known,
        robot,
        PlannerSettings(door_distance=nominal.door_distance, hinge_x=nominal.hinge_x),
    )
    assert placed.hit.stance.step == pytest.approx(plan.hit.stance.step, abs=1e-5)
    assert placed.v_rb == pytest.approx(plan.v_rb, rel=1e-6)
