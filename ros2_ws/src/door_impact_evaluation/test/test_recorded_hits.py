"""Phases, contact and peak of the hits in a recording, from plans, trajectories and reports."""

import math
from types import SimpleNamespace as Some

import numpy as np
import pytest
from door_impact_evaluation.report.bag import Angles, Bag, Series
from door_impact_evaluation.report.hits import find_hits
from hypothesis import given
from hypothesis import strategies as st

NAMES = ["a", "b"]
PHASES = ("prepare", "shift", "cam", "post", "hold")
START = 100.0
SWITCH = START + 5.6  # the executor's second trajectory, after the contact
CONTACT_TIME = 0.5    # after the start of cam


def knots(rows, begin=0.0, order=(0, 1)):
    """A trajectory with a knot each second."""
    points = [Some(positions=[row[i] for i in order],
                   time_from_start=Some(sec=int(begin + k), nanosec=0))
              for k, row in enumerate(rows)]
    return Some(joint_names=[NAMES[i] for i in order], points=points)


def plan(name="p"):
    """Phases of two seconds each; cam returns to where it began, as a missed run-up does."""
    rows = [(0.1 * k, -0.2 * k) for k in range(11)]
    rows[6] = rows[4]
    phases = [Some(name=phase, trajectory=knots(rows[2 * k:2 * k + 3]))
              for k, phase in enumerate(PHASES)]
    return Some(plan_id=name, phases=phases, contact_time=CONTACT_TIME, ending="hold",
                desired_opening_angle=0.4)


def sent(order=(0, 1)):
    """What the executor sends: prepare to cam at first, then the motions after contact and peak."""
    first = [point.positions for phase in plan().phases[:3] for point in phase.trajectory.points]
    del first[6], first[3]  # a phase's last knot is the next one's first
    other = [(5.0, 5.0), (6.0, 6.0)]
    return [(START, knots(first, order=order)), (SWITCH, knots(other)),
            (SWITCH + 1.0, knots([*other, (7.0, 7.0)]))]


def door(contact=START + 4.51, rate=0.3):
    """A door that opens from its contact on for 1.5 s and falls back."""
    t = np.arange(START, START + 12.0, 0.01)
    since = np.clip(t - contact, 0.0, None)
    return Angles(("hinge",), Series(t, (rate * since - 0.1 * since**2)[:, None]), None)


def report(delay=0.01, peak=1.5):
    return Some(plan_id="p", contact_delay=delay, peak_time=peak)


def test_phases_begin_where_the_trajectory_has_their_knots():
    """Contact and peak by the report; the end is that of the last trajectory."""
    (hit,) = find_hits(Bag(plans=[(90.0, plan())], trajectories=sent(),
                           reports=[(120.0, report())]))
    assert hit.contact == pytest.approx(START + 4.0 + CONTACT_TIME + 0.01)
    assert hit.peak == pytest.approx(hit.contact + 1.5)
    assert hit.starts == [(START, "prepare"), (START + 2.0, "shift"), (START + 4.0, "cam"),
                          (hit.contact, "post"), (hit.peak, "hold")]
    assert hit.end == pytest.approx(SWITCH + 3.0)


def test_without_a_report_the_door_shows_contact_and_peak():
    """The recording may end before the report, or be of another executor."""
    (hit,) = find_hits(Bag(plans=[(90.0, plan())], trajectories=sent(), door=door()))
    assert hit.contact == pytest.approx(START + 4.51, abs=0.03)
    assert hit.peak == pytest.approx(START + 6.01, abs=0.02)


def test_a_missed_door_has_no_contact():
    """NaN in the report, or a door that never moves: the phases up to the run-up remain."""
    for bag in (Bag(plans=[(90.0, plan())], trajectories=sent(), door=door(),
                    reports=[(120.0, report(math.nan, math.nan))]),
                Bag(plans=[(90.0, plan())], trajectories=sent(), door=door(rate=0.0)),
                Bag(plans=[(90.0, plan())], trajectories=sent())):
        (hit,) = find_hits(bag)
        assert (hit.contact, hit.peak) == (None, None)
        assert [name for _, name in hit.starts] == ["prepare", "shift", "cam"]


def test_two_hits_are_two():
    """Each with the plan that was the last one before it, and with its own report."""
    later = [(start + 50.0, trajectory) for start, trajectory in sent()]
    hits = find_hits(Bag(
        plans=[(90.0, plan()), (140.0, plan("q"))], trajectories=[*sent(), *later],
        reports=[(120.0, report()), (170.0, Some(**{**vars(report(0.02)), "plan_id": "q"}))]))
    assert [hit.plan.plan_id for hit in hits] == ["p", "q"]
    assert hits[1].contact - hits[0].contact == pytest.approx(50.01)
    assert hits[0].end < hits[1].starts[0][0]


@given(st.lists(st.sampled_from(range(3)), max_size=3), st.booleans())
def test_other_motions_are_no_hits(chosen, planned):
    """A walk, a stop or a part of a plan: whatever is sent, nothing is raised or invented."""
    strange = [(START, knots([(9.0, 9.0), (8.0, 8.0)])), (START + 1.0, Some(
        joint_names=[], points=[])), (START + 2.0, Some(joint_names=["c"], points=[Some(
            positions=[0.0], time_from_start=Some(sec=1, nanosec=0))]))]
    bag = Bag(plans=[(90.0, plan())] if planned else [], trajectories=[strange[k] for k in chosen],
              door=door())
    assert find_hits(bag) == []
