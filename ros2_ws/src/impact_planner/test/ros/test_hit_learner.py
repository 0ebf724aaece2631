"""Sequences of reports of hits, true and forged, for the learner of the node impact_planner."""

import logging
import math

from action_msgs.msg import GoalInfo, GoalStatus, GoalStatusArray
from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_msgs.msg import HitReport
from hypothesis import given
from hypothesis import strategies as st
from impact_planner.hit import momentum
from impact_planner.ros.hit_learner import HitLearner
from impact_planner.task.experience import Experience
from unique_identifier_msgs.msg import UUID

QUIET = logging.getLogger("quiet")
QUIET.addHandler(logging.NullHandler())
QUIET.propagate = False
SUCCEEDED, EXECUTING = GoalStatus.STATUS_SUCCEEDED, GoalStatus.STATUS_EXECUTING

anything = st.floats(allow_nan=True, allow_infinity=True)
contents = st.fixed_dictionaries({
    "peak_angle": st.floats(0.2, 0.7) | anything,
    "v_rb_post": st.floats(-0.5, 0.5) | anything,
    "contact_delay": st.floats(-0.05, 0.05) | anything,
    "switch_latency": st.just(0.012) | anything,
    "error_code": st.sampled_from([0, 0, 0, 5, 6, 8]),
})
ends = st.sampled_from([SUCCEEDED, SUCCEEDED, GoalStatus.STATUS_ABORTED,
                        GoalStatus.STATUS_CANCELED])
# Whether the report names a goal of its own, how this goal ends, and what the report says.
twenty = st.lists(st.tuples(st.booleans(), ends, contents), min_size=20, max_size=20)


def state(name, status):
    """The state of one goal, as an action server publishes it."""
    info = GoalInfo(goal_id=UUID(uuid=list(name)))
    return GoalStatusArray(status_list=[GoalStatus(goal_info=info, status=status)])


def next_speed(learner, plan):
    """v_rB of the next plan for the same angle [m/s]."""
    known = learner.experience(plan.door) or Experience.none(plan.restitution)
    return momentum.speeds_for(
        plan.omega_door, i_a=plan.known.door.i_a, l_b=plan.l_b, braking=plan.braking,
        effective_mass=known.mass_factor * plan.effective_mass_model,
        restitution=plan.apparent_restitution + plan.hit.transfer.restitution_slope * (
            known.restitution - plan.restitution)).v_rb


@given(twenty, st.randoms(use_true_random=False))
def test_forged_reports_move_nothing_and_no_report_leads_beyond_the_limits(plan, reports, random):
    """Of 20 reports, those without a goal change no v_rB; others keep to 0.3..0.7, 0.7..1.25."""
    learner = HitLearner(None, QUIET)
    learner.planned(plan, plan.known)
    used = []
    for number, (own, end, content) in enumerate(reports):
        name = bytes([number]) * 16
        if own:
            learner.on_goals(state(name, EXECUTING))
            used.append(name)
        elif used and random.random() < 0.5:
            name = random.choice(used)  # a goal that has had its report
        before = next_speed(learner, plan)
        steps = [(learner.on_report, HitReport(
            plan_id=plan.plan_id, door=plan.door, goal_id=UUID(uuid=list(name)), **content))]
        steps += [(learner.on_goals, state(name, end))] * own
        random.shuffle(steps)
        for take, message in steps:
            take(message)
        if not own:
            assert next_speed(learner, plan) == before
        known = learner.experience(plan.door)
        assert known is None or 0.3 <= known.restitution <= 0.7
        assert known is None or 0.7 <= known.mass_factor <= 1.25


def test_honest_hits_among_forged_ones_are_learned(plan):
    """Ten good hits count, although ten forged reports lie between them; one was not held."""
    learner = HitLearner(None, QUIET)
    learner.planned(plan, plan.known)
    good = {"plan_id": plan.plan_id, "peak_angle": 1.01 * plan.desired_opening_angle,
            "v_rb_post": math.nan, "switch_latency": 0.012}
    for number in range(10):
        goal = bytes([number]) * 16
        learner.on_goals(state(goal, EXECUTING))
        held = number > 0
        learner.on_report(HitReport(goal_id=UUID(uuid=list(goal)), **good, error_code=0 if held
                                    else ExecuteDoorImpact.Result.NOT_HELD))
        learner.on_goals(state(goal, SUCCEEDED if held else GoalStatus.STATUS_ABORTED))
        learner.on_report(HitReport(**good | {"peak_angle": 0.3}))
    assert learner.experience(plan.door).hits == 10
    assert 0.97 * plan.v_rb < next_speed(learner, plan) < plan.v_rb
