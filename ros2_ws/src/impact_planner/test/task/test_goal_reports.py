"""Which reports count: one for each goal that was seen running and has ended."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from impact_planner.errors import ImplausibleHit
from impact_planner.ros.hit_learner import GoalReports

names = st.sampled_from([b"a", b"b", b"c", b"d"])
goals = st.tuples(st.just("goal"), names, st.sampled_from([None, 4, 5, 6]))
reports = st.tuples(st.just("report"), names, st.integers())


@given(st.lists(goals | reports, max_size=40))
def test_a_report_counts_once_after_its_goal_ran_and_ended(events):
    """In any order of states and reports, only the first report of a goal that ran counts."""
    known, running, ended, first, counted = GoalReports(), set(), {}, {}, []
    for kind, name, value in events:
        if kind == "goal":
            got = known.goal(name, value)
            running |= {name} if value is None else set()
            if name in running and value is not None:
                ended[name] = value
        elif name not in running or name in first:
            with pytest.raises(ImplausibleHit, match=name.hex()):
                known.report(name, value)
            continue
        else:
            got = known.report(name, value)
            first[name] = value
        if got is not None:
            counted.append(name)
            assert got == (first[name], ended[name])
    assert len(counted) == len(set(counted))
    assert set(counted) <= set(first) & set(ended)


def test_old_goals_are_forgotten():
    """Only the last goals are remembered, so that memory does not grow."""
    known = GoalReports()
    for number in range(100):
        known.goal(bytes([number]), None)
    with pytest.raises(ImplausibleHit):
        known.report(bytes([0]), "hit")
    assert known.report(bytes([99]), "hit") is None
