"""Phases, contact and peak of the hits in a recording, from plans, trajectories and the door."""

from types import SimpleNamespace as Some

import numpy as np
import pytest
from door_impact_evaluation.report.bag import find_hits
from door_impact_evaluation.report.recorded_run import Series
from hypothesis import given
from hypothesis import strategies as st

NAMES = ["a", "b"]
PHASES = ("prepare", "shift", "cam", "post", "hold")
START = 100.0
SWITCH = START + 5.6  # the executor's second trajectory, after the contact
CONTACT = START + 4.51


def knots(rows):
    """A trajectory with a knot each second."""
    points = [Some(positions=list(row), time_from_start=Some(sec=k, nanosec=0))
              for k, row in enumerate(rows)]
    return Some(joint_names=NAMES, points=points)


def plan(name="p"):
    """Phases of two seconds each; cam returns to where it began, as a missed run-up does."""
    rows = [(0.1 * k, -0.2 * k) for k in range(11)]
    rows[6] = rows[4]
    phases = [Some(name=phase, trajectory=knots(rows[2 * k:2 * k + 3]))
              for k, phase in enumerate(PHASES)]
    return Some(plan_id=name, phases=phases, ending="hold")


def sent(later=0.0):
    """What the executor sends: prepare to cam at first, then the motions after contact and peak."""
    first = [point.positions for phase in plan().phases[:3] for point in phase.trajectory.points]
    del first[6], first[3]  # a phase's last knot is the next one's first
    other = [(5.0, 5.0), (6.0, 6.0)]
    return [(START + later, knots(first)), (SWITCH + later, knots(other)),
            (SWITCH + later + 1.0, knots([*other, (7.0, 7.0)]))]


def door(*contacts, rate=0.3):
    """A door that opens from each contact on for 1.5 s and falls back."""
    t = np.arange(START, START + 62.0, 0.01)
    angle = np.zeros(len(t))
    for contact in contacts:
        since = np.clip(t - contact, 0.0, 3.0)
        angle += rate * since - 0.1 * since**2
    return Series(t, angle[:, None])


def test_phases_begin_where_the_trajectory_has_their_knots():
    """Contact and peak are those of the door; the end is that of the last trajectory."""
    (hit,) = find_hits([(90.0, plan())], sent(), door(CONTACT))
    assert hit.contact == pytest.approx(CONTACT, abs=0.03)
    assert hit.peak == pytest.approx(CONTACT + 1.5, abs=0.02)
    assert hit.starts == [(START, "prepare"), (START + 2.0, "shift"), (START + 4.0, "cam"),
                          (hit.contact, "post"), (hit.peak, "hold")]
    assert hit.end == pytest.approx(SWITCH + 3.0)


@pytest.mark.parametrize("leaf", [None, door(CONTACT, rate=0.0), door()])
def test_a_missed_door_has_no_contact(leaf):
    """A door that never opens, or none in the recording: the phases up to the run-up remain."""
    (hit,) = find_hits([(90.0, plan())], sent(), leaf)
    assert (hit.contact, hit.peak) == (None, None)
    assert [name for _, name in hit.starts] == ["prepare", "shift", "cam"]


def test_two_hits_are_two():
    """Each with the plan that was the last one before it, and with its own contact."""
    hits = find_hits([(90.0, plan()), (140.0, plan("q"))], [*sent(), *sent(50.0)],
                     door(CONTACT, CONTACT + 50.0))
    assert [hit.plan.plan_id for hit in hits] == ["p", "q"]
    assert hits[1].contact - hits[0].contact == pytest.approx(50.0, abs=0.02)
    assert hits[0].end < hits[1].starts[0][0]


@given(st.lists(st.sampled_from(range(3)), max_size=3), st.booleans())
def test_other_motions_are_no_hits(chosen, planned):
    """A walk, a stop or a part of a plan: whatever is sent, nothing is raised or invented."""
    strange = [(START, knots([(9.0, 9.0), (8.0, 8.0)])), (START + 1.0, Some(
        joint_names=[], points=[])), (START + 2.0, Some(joint_names=["c"], points=[Some(
            positions=[0.0], time_from_start=Some(sec=1, nanosec=0))]))]
    plans = [(90.0, plan())] if planned else []
    assert find_hits(plans, [strange[k] for k in chosen], door(CONTACT)) == []
