"""Sequences of reports of hits, true and false, for the learner of the node impact_planner."""

import logging
import math

from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_msgs.msg import HitReport
from hypothesis import given
from hypothesis import strategies as st
from impact_planner.hit import momentum
from impact_planner.ros.hit_learner import HitLearner
from impact_planner.task.experience import Experience

QUIET = logging.getLogger("quiet")
QUIET.addHandler(logging.NullHandler())
QUIET.propagate = False

anything = st.floats(allow_nan=True, allow_infinity=True)
contents = st.fixed_dictionaries({
    "peak_angle": st.floats(0.2, 0.7) | anything,
    "v_rb_post": st.floats(-0.5, 0.5) | anything,
    "contact_delay": st.floats(-0.05, 0.05) | anything,
    "switch_latency": st.just(0.012) | anything,
    "error_code": st.sampled_from([0, 0, 0, 5, 6, 8]),
})
twenty = st.lists(contents, min_size=20, max_size=20)


def next_speed(learner, plan):
    """v_rB of the next plan for the same angle [m/s]."""
    known = learner.experience(plan.door) or Experience.none(plan.restitution)
    return momentum.speeds_for(
        plan.omega_door, i_a=plan.known.door.i_a, l_b=plan.l_b, braking=plan.braking,
        effective_mass=known.mass_factor * plan.effective_mass_model,
        restitution=plan.apparent_restitution + plan.hit.transfer.restitution_slope * (
            known.restitution - plan.restitution)).v_rb


@given(twenty)
def test_no_reports_lead_beyond_the_limits(plan, reports):
    """Restitution keeps to 0.3..0.7 and the mass to 0.7..1.25; a disturbed hit changes nothing."""
    learner = HitLearner(None, QUIET)
    learner.planned(plan, plan.known)
    for content in reports:
        before = next_speed(learner, plan)
        learner.on_report(HitReport(plan_id=plan.plan_id, door=plan.door, **content))
        if content["error_code"] not in (0, ExecuteDoorImpact.Result.NOT_HELD):
            assert next_speed(learner, plan) == before
        known = learner.experience(plan.door)
        assert known is None or 0.3 <= known.restitution <= 0.7
        assert known is None or 0.7 <= known.mass_factor <= 1.25


def test_honest_hits_among_those_that_cannot_be_are_learned(plan):
    """Ten good hits count, although reports of other plans lie between them; one was not held."""
    learner = HitLearner(None, QUIET)
    learner.planned(plan, plan.known)
    good = {"plan_id": plan.plan_id, "peak_angle": 1.01 * plan.desired_opening_angle,
            "v_rb_post": math.nan, "switch_latency": 0.012}
    for number in range(10):
        learner.on_report(HitReport(
            **good, error_code=0 if number else ExecuteDoorImpact.Result.NOT_HELD))
        learner.on_report(HitReport(**good | {"plan_id": "another"}))
    assert learner.experience(plan.door).hits == 10
    assert 0.97 * plan.v_rb < next_speed(learner, plan) < plan.v_rb
