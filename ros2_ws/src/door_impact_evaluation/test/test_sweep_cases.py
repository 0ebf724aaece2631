"""The cases that a sweep draws are the same for the same seed, and within the stated ranges."""

from dataclasses import replace

import pytest
from door_impact_evaluation.sweep.hit_cases import NOMINAL, HitCase
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
@settings(phases=[Phase.generate])  # a seed has nothing to shrink
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


@given(seeds, st.integers(1, 5))
@settings(phases=[Phase.generate])  # a seed has nothing to shrink
def test_other_seeds_draw_other_cases(seed, off):
    """Two seeds share the nominal cases and no other one."""
    ours, theirs = ({each.pushes_deg for each in drawn(6, s)} for s in (seed, seed + off))
    assert len(ours) == 12
    assert not ours & theirs
    assert cases(1, seed)[:6] == cases(1, seed + off)[:6]


@given(seeds)
@settings(phases=[Phase.generate])  # a seed has nothing to shrink
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


def test_the_draws_fill_their_ranges():
    """A hundred draws come near both ends of each range."""
    for name, low, high in (("door_offset", -0.02, 0.02), ("restitution", 0.4, 0.6),
                            ("rotor_scale", 0.7, 1.4), ("friction", 0.5, 1.0),
                            ("gear_scale", 0.5, 2.0), ("pad_scale", 0.5, 2.0)):
        found = [getattr(case, name) for case in drawn(100, 3) if case.group == "rough"]
        edge = 0.1 * (high - low)
        assert min(found) < low + edge, name
        assert max(found) > high - edge, name
    for part in range(3):
        found = [case.closer[part] for case in drawn(100, 3)]
        assert min(found) < 0.92 < 1.08 < max(found)


def test_nominal_doors_are_known_exactly_and_simulated_as_they_are():
    """The planner knows the configured door, without a covariance."""
    for case in cases(1, 1)[:6]:
        known = case.known()
        assert case.config() == load_door(case.door)
        assert known.door == load_door(case.door).door()
        assert known.covariance is None
        assert known.experience is None


@pytest.mark.parametrize("number", [0, 1, 2])
def test_a_perturbed_door_is_known_by_its_own_swings(number):
    """tau'_c0 is known to 2 % and I_A to 1 %, although the door is up to 10 % off the paper's."""
    case = replace(drawn(3, 1)[number], closer=(1.1, 0.95, (0.9, 1.05, 1.1)[number]))
    door, known = case.config().door(), case.known()
    assert door.tau_c0_prime == pytest.approx(case.closer[2] * PAPER.tau_c0_prime)
    assert (door.c_c, door.k_c) == pytest.approx((1.1 * PAPER.c_c, 0.95 * PAPER.k_c))
    assert known.door.tau_c0_prime == pytest.approx(door.tau_c0_prime, rel=0.02)
    assert known.door.i_a == pytest.approx(door.i_a, rel=0.01)
    assert "tau_c0_prime" in known.parameters
    assert known.covariance is not None


def test_each_hit_of_a_case_has_other_noise_and_the_same_door():
    """From hit to hit only the sensors' seed changes."""
    case = HitCase("rough", 0, seed=7, restitution=0.55, rotor_scale=0.8, friction=0.6,
                gear_scale=1.5, pad_scale=0.7)
    first, second = case.world(0), case.world(1)
    assert first["seed"] != second["seed"]
    assert {**first, "seed": 0} == {**second, "seed": 0}
    assert first == {"seed": 7, "restitution": 0.55, "rotor_scale": 0.8, "friction": 0.6,
                     "gear_scale": 1.5, "pad_scale": 0.7}


def test_names_within_a_sweep_are_unique():
    """The table names the worst runs by them."""
    names = [case.name for case in cases(30, 1)]
    assert len(set(names)) == len(names) == 66
    assert NOMINAL[0][0] == "paper"
