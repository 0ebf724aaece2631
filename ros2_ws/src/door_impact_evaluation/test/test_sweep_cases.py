"""The cases that a sweep draws are the same for the same seed, and within the stated ranges."""

from dataclasses import replace

import pytest
from door_impact_evaluation.sweep.hit_cases import hit_cases as cases
from door_model.door.config import load_door
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

seeds = st.integers(0, 2**32)
PAPER = load_door("paper")


def drawn(n, seed):
    """Returns the cases that are not nominal."""
    return [case for case in cases(n, seed) if case.group != "nominal"]


@given(st.integers(1, 12), st.integers(0, 12), seeds)
@settings(phases=[Phase.generate], max_examples=5)  # a seed has nothing to shrink
def test_a_longer_sweep_begins_with_the_shorter_ones_cases(n, more, seed):
    """This holds in each group; the same seed draws the same cases, and no two are alike."""
    short, long = cases(n, seed), cases(n + more, seed)
    assert cases(n, seed) == short
    for group, size in (("nominal", 6), ("perturbed", n), ("rough", n)):
        few = [case for case in short if case.group == group]
        assert len(few) == size
        assert [case for case in long if case.group == group][:size] == few
    assert len({(case.group, case.index) for case in long}) == len(long)
    assert len({case.seed for case in drawn(n, seed)}) == 2 * n


@given(seeds)
@settings(phases=[Phase.generate], max_examples=5)  # a seed has nothing to shrink
def test_every_draw_is_within_its_range(seed):
    """The ranges of rough cases are wider, and these doors are hit twice."""
    for case in drawn(20, seed):
        rough = case.group == "rough"
        assert case.hits == 1 + rough
        assert case.door == "paper"
        assert abs(case.door_offset) <= 0.02
        assert all(0.9 <= factor <= 1.1 for factor in case.closer)
        assert abs(case.restitution - PAPER.restitution) <= (0.1 if rough else 0.03)
        low, high = (0.7, 1.4) if rough else (0.9, 1.1)
        assert low <= case.rotor_scale <= high
        assert 0.5 <= case.friction <= 1.0
        low, high = (0.5, 2.0) if rough else (0.7, 1.3)
        assert low <= case.gear_scale <= high
        assert low <= case.pad_scale <= high
        assert len(case.pushes_deg) == 5
        assert all(10.0 <= each <= 32.0 for each in case.pushes_deg)
        assert 0.0 <= case.phase < 1.0


def test_a_perturbed_door_is_known_by_its_own_swings():
    """tau'_c0 is known to 2 % and I_A to 1 %, although the door is up to 10 % off the paper's."""
    case = replace(drawn(1, 1)[0], closer=(1.1, 0.95, 0.9))
    door, known = case.config().door(), case.known()
    assert door.tau_c0_prime == pytest.approx(case.closer[2] * PAPER.tau_c0_prime)
    assert (door.c_c, door.k_c) == pytest.approx((1.1 * PAPER.c_c, 0.95 * PAPER.k_c))
    assert known.door.tau_c0_prime == pytest.approx(door.tau_c0_prime, rel=0.02)
    assert known.door.i_a == pytest.approx(door.i_a, rel=0.01)
    assert "tau_c0_prime" in known.parameters
    assert known.covariance is not None
