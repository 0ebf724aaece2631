"""The whole pipeline: consistent numbers, continuous phases and refusals."""

import dataclasses
import math

import numpy as np
import pytest
from door_model.door.config import load_door
from door_model.identification.parameters import PARAMETERS
from door_model.motion.dynamics import peak
from hrp2_description.robot import SIDES
from humanoid_motion.errors import PostureUnreachable
from humanoid_motion.knots import TOLERANCE
from humanoid_motion.robot_model import RobotModel
from hypothesis import given
from hypothesis import strategies as st
from impact_planner.errors import (
    PLANNING_ERRORS,
    AngleUnreachable,
    InvalidRequest,
    SpeedUnreachable,
)
from impact_planner.hit import momentum
from impact_planner.hit.door_prediction import predict
from impact_planner.hit.leaf import LeafFrame
from impact_planner.plan import placement_for_step, plan_impact
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest
from impact_planner.task.settings import ENDINGS, RUN_UPS, PlannerSettings

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


def test_equations_hold_between_the_stated_numbers(robot, known, plan):
    """Eqs. (2), (3) and (4) and restitution hold, and the door peaks at the target."""
    gained = known.door.i_a * plan.omega_door + plan.braking
    assert plan.v_rb == pytest.approx(
        gained / (plan.effective_mass * plan.l_b) + plan.v_rb_post)
    assert plan.omega_door * plan.l_b - plan.v_rb_post == pytest.approx(
        plan.apparent_restitution * plan.v_rb)
    assert plan.required_impulse == pytest.approx(
        plan.effective_mass * (plan.v_rb - plan.v_rb_post)
    )
    assert plan.effective_mass_planar == pytest.approx(
        momentum.effective_mass_planar(robot.mass, plan.i_rob, plan.a_r)
    )
    summit = peak(known.door, 0.0, plan.omega_door)
    assert summit.angle == pytest.approx(TARGET, abs=1e-6)
    assert plan.peak_time == pytest.approx(summit.time)


def test_phases_are_in_order_and_join_without_a_step(plan):
    """Each phase begins where the previous one ends, and at rest except after the hit."""
    assert [phase.name for phase in plan.phases] == ORDER
    for before, after in zip(plan.phases, plan.phases[1:], strict=False):
        end = before.knots.position[-1]
        if before.name == "cam":
            end = before.knots.at(plan.switch_time)[0][0]
        np.testing.assert_allclose(after.knots.position[0], end, atol=1e-4, err_msg=after.name)
        assert after.knots.time[0] == 0.0
        if after.name != "post":
            np.testing.assert_allclose(after.knots.velocity[0], 0.0, atol=1e-6)


def test_the_motion_starts_in_half_sitting_and_ends_at_rest(robot, plan):
    """The first knot is half-sitting, and the last knot is at rest."""
    np.testing.assert_allclose(
        plan.phases[0].knots.position[0], robot.config.half_sitting, atol=1e-9
    )
    np.testing.assert_allclose(plan.phases[-1].knots.velocity[-1], 0.0, atol=1e-6)


def test_every_margin_has_a_reserve(plan):
    """The margin exceeds 15 mm in the slow phases and 0 in the run-up."""
    for name, margin in plan.zmp_margins.items():
        assert margin > (0.0 if name == "cam" else 0.015), name


def test_splines_through_the_knots_keep_the_joints_limits(robot, plan):
    """The splines, not only the samples, keep the joints' limits with at most 60 knots."""
    for phase in plan.phases:
        time = np.linspace(0.0, phase.knots.time[-1], 400)
        position, velocity, _ = phase.knots.at(time)
        assert np.all(position >= robot.lower - TOLERANCE), phase.name
        assert np.all(position <= robot.upper + TOLERANCE), phase.name
        assert np.all(np.abs(velocity) <= robot.speed_limit * 1.001), phase.name
        assert len(phase.knots.time) <= 60
        assert phase.torque_ratio < 1.0
        assert phase.com.shape == (len(phase.knots.time), 3)
        assert phase.zmp.shape == (len(phase.knots.time), 2)


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


@pytest.mark.parametrize("initial_deg", [5.0, 15.0, 25.0])
def test_b_is_where_it_was_asked_for_however_far_the_door_is_ajar(robot, known, initial_deg):
    """For any initial angle, B is on the leaf and at the requested l_B to 2 micrometres."""
    initial = math.radians(initial_deg)
    request = PlanRequest(initial + 0.15, initial_angle=initial, l_b=0.42, ending="retreat")
    plan = plan_impact(request, known, robot)
    assert plan.l_b == pytest.approx(0.42, abs=2e-6)
    leaf = LeafFrame(plan.hit.placement.hinge, initial)
    assert leaf.gap(plan.contact_point) == pytest.approx(0.0, abs=1e-6)


def test_same_request_same_plan_id_other_request_another(robot, known, plan):
    """Equal requests have equal plan ids, and different requests different ones."""
    assert plan_impact(PlanRequest(TARGET), known, robot).plan_id == plan.plan_id
    assert plan_impact(PlanRequest(TARGET * 0.9), known, robot).plan_id != plan.plan_id


@pytest.mark.parametrize("angle", [math.nan, math.inf, -math.inf, 0.0, -0.3])
def test_what_is_no_angle_is_an_invalid_request(robot, known, angle):
    """An angle that is not finite and positive is an invalid request."""
    with pytest.raises(InvalidRequest, match="desired_opening_angle"):
        plan_impact(PlanRequest(angle), known, robot)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("initial_angle", math.nan),
        ("initial_angle", -0.1),
        ("initial_angle", 0.5),
        ("restitution", 1.01),
        ("restitution", -0.2),
        ("restitution", math.nan),
        ("effective_mass", 0.0),
        ("effective_mass", math.inf),
        ("door_distance", 0.0),
        ("door_distance", math.nan),
        ("l_b", -0.1),
        ("l_b", math.nan),
        ("run_up", "sprint"),
        ("ending", "bow"),
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


def test_a_retreat_is_planned_where_the_hand_reaches_no_more(robot, known):
    """At 8 deg the door is shut before the arm arrives, but the robot can retreat in time."""
    angle = math.radians(8.0)
    with pytest.raises(AngleUnreachable):
        plan_impact(PlanRequest(angle), known, robot)
    plan = plan_impact(PlanRequest(angle, ending="retreat"), known, robot)
    assert plan.peak_angle == pytest.approx(angle, abs=1e-6)


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


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_door_that_falls_shut_on_the_robot_is_refused(robot, known, ending):
    """At 3 deg the leaf comes too near for a retreat, which a cancel needs with any ending."""
    with pytest.raises(PostureUnreachable, match=r"retreat: RARM_LINK3 .* from the leaf") as caught:
        plan_impact(PlanRequest(math.radians(3.0), ending=ending), known, robot)
    assert caught.value.value < caught.value.limit


def test_a_door_too_strong_for_the_hand_is_refused(robot, known):
    """A force above hand_force_limit is refused."""
    with pytest.raises(AngleUnreachable, match=r"5\.0 N are allowed"):
        plan_impact(PlanRequest(TARGET), known, robot, PlannerSettings(hand_force_limit=5.0))


@given(
    st.floats(0.02, 1.2), st.sampled_from(["paper", "size2", "size3", "size4"]),
    st.sampled_from(RUN_UPS))
def test_any_angle_of_any_door_gives_a_sound_plan_or_a_reason(robot, angle, name, run_up):
    """Planning raises nothing but PLANNING_ERRORS, and no plan breaks a limit."""
    config = load_door(name)
    known = KnownDoor(config.name, config.door(), config.leaf.width)
    refused = None
    try:
        plan = plan_impact(PlanRequest(angle, run_up=run_up), known, robot)
    except PLANNING_ERRORS as error:
        refused = error
    if refused is not None:
        assert str(refused)
        assert refused.value is not None
        return
    assert min(plan.zmp_margins.values()) >= 0.02
    assert max(phase.torque_ratio for phase in plan.phases) <= 0.9
    assert max(phase.speed_ratio for phase in plan.phases) <= 0.9 + 1e-9
    assert peak(known.door, 0.0, plan.omega_door).angle == pytest.approx(angle, abs=1e-5)


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
