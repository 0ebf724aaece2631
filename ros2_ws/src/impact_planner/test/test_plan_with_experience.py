"""Plans for a door that was hit before."""

import math
from dataclasses import replace

import numpy as np
import pytest
from impact_planner.hit import momentum
from impact_planner.plan import plan_impact
from impact_planner.task.experience import Experience
from impact_planner.task.request import PlanRequest, resolve
from impact_planner.task.settings import PlannerSettings

TARGET = math.radians(25.0)
TAUGHT = Experience(3, 0.9, 0.42, np.diag([1e-3, 1e-3]))


@pytest.fixture(scope="module")
def hit_before(known):
    """The paper's door after three hits."""
    return replace(known, experience=TAUGHT)


@pytest.fixture(scope="module")
def taught(hit_before, robot):
    """The plan for the paper's door after three hits."""
    return plan_impact(PlanRequest(TARGET), hit_before, robot)


def test_a_plan_uses_what_hits_have_taught(hit_before, plan, taught):
    """Learned restitution and mass decide the speeds, but not w'."""
    assert (plan.learned_hits, taught.learned_hits) == (0, 3)
    assert plan.effective_mass == plan.effective_mass_model
    assert taught.restitution == 0.42
    assert taught.effective_mass == pytest.approx(0.9 * taught.effective_mass_model, rel=1e-12)
    assert taught.effective_mass_model == pytest.approx(plan.effective_mass_model, rel=0.03)
    assert taught.omega_door == plan.omega_door
    speeds = momentum.speeds_for(
        taught.omega_door, i_a=hit_before.door.i_a, l_b=taught.l_b,
        braking=taught.braking, effective_mass=taught.effective_mass,
        restitution=taught.apparent_restitution)
    assert taught.apparent_restitution < plan.apparent_restitution - 0.03
    assert taught.v_rb == speeds.v_rb > plan.v_rb
    assert taught.v_rb_post == speeds.v_rb_post
    assert taught.plan_id != plan.plan_id


def test_mass_and_restitution_of_one_request_are_those_of_the_whole_hit(known, robot, plan):
    """With both, eqs. (2) to (4) use them as they are; learning still compares with the model."""
    found = plan_impact(
        PlanRequest(TARGET, restitution=0.4, effective_mass=52.0), known, robot)
    assert (found.apparent_restitution, found.effective_mass) == (0.4, 52.0)
    assert found.omega_door * found.l_b - found.v_rb_post == pytest.approx(0.4 * found.v_rb)
    transfer = found.hit.transfer
    assert transfer.response.restitution < plan.apparent_restitution - 0.03
    alone = plan_impact(PlanRequest(TARGET, restitution=0.4), known, robot)
    assert alone.apparent_restitution == pytest.approx(transfer.response.restitution, abs=0.01)


def test_the_closer_and_the_friction_of_the_hinge_brake_the_hit(known, robot):
    """braking is about half of the contact's duration times the torque of closer and friction."""
    rough = replace(known, door=replace(known.door, friction=1.5))
    ajar = math.radians(3.0)
    found = plan_impact(
        PlanRequest(TARGET, initial_angle=ajar), rough, robot,
        PlannerSettings(contact_duration=0.02))
    torque = float(known.door.restoring_torque(ajar)) + 1.5
    assert found.braking == pytest.approx(0.5 * found.contact_duration * torque, rel=0.25)
    assert found.required_impulse * found.l_b == pytest.approx(
        known.door.i_a * found.omega_door + found.braking)


def test_a_request_is_filled_in_from_the_request_then_from_hits_then_from_the_settings(
        known, hit_before):
    """Values come from the request, then from hits, then from the settings."""
    settings, bare = PlannerSettings(restitution=0.7), PlanRequest(TARGET)
    found = resolve(bare, settings, known)
    assert (found.restitution, found.mass_factor, found.effective_mass) == (0.7, 1.0, None)
    found = resolve(bare, replace(settings, effective_mass=50.0), hit_before)
    assert (found.restitution, found.mass_factor, found.effective_mass) == (0.42, 0.9, 50.0)
    found = resolve(PlanRequest(TARGET, restitution=0.0, effective_mass=49.0), settings, hit_before)
    assert (found.restitution, found.effective_mass) == (0.0, 49.0)


def test_experience_that_alone_prevents_the_plan_is_set_aside(known, robot, plan):
    """Without it the plan is possible, so that this plan is made, with a warning."""
    weak = Experience(2, 0.7, 0.3, np.diag([1e-3, 1e-3]))
    found = plan_impact(PlanRequest(TARGET), replace(known, experience=weak), robot)
    assert (found.plan_id, found.v_rb, found.learned_hits) == (plan.plan_id, plan.v_rb, 0)
    (warning,) = set(found.warnings) - set(plan.warnings)
    assert "set aside" in warning


def test_experience_outside_the_limits_is_set_aside(known, robot, plan):
    """An older file may hold what cannot be; wider limits obey it."""
    odd = replace(known, experience=Experience(5, 1.96, 0.07, np.diag([1e-3, 1e-3])))
    found = plan_impact(PlanRequest(TARGET), odd, robot)
    assert found.plan_id == plan.plan_id
    assert any("set aside" in warning for warning in found.warnings)
    wide = PlannerSettings(least_restitution=0.0, largest_restitution=1.0,
                           least_mass_factor=0.3, largest_mass_factor=3.0)
    assert odd.experience.outside(wide.learning_limits) == ""
