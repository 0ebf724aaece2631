"""What hits have taught: an odd hit does not outvote it, and two hits that agree do."""

import math
from dataclasses import replace

import pytest
from impact_planner.errors import ImplausibleHit
from impact_planner.hit import momentum
from impact_planner.hit.learning import ObservedHit
from impact_planner.hit.memory import HitMemory
from impact_planner.task.experience import Experience, Limits

LIMITS, OMEGA = Limits(), 0.635
DOOR = {"i_a": 12.75, "l_b": 0.42, "braking": 0.07}
MASS = 58.0


def strike(memory: HitMemory, restitution: float, odd: float = 1.0) -> ObservedHit:
    """A hit that is planned for 0.635 rad/s by what was learned; `odd` is a factor on w'."""
    known = memory.known.get("paper", Experience.none(0.5))
    v_rb = momentum.speeds_for(OMEGA, effective_mass=known.mass_factor * MASS,
                               restitution=known.restitution, **DOOR).v_rb
    omega = momentum.omega_for(v_rb, effective_mass=MASS, restitution=restitution, **DOOR)
    return ObservedHit(MASS, DOOR["i_a"], DOOR["l_b"], v_rb, math.nan, odd * omega, 0.07,
                       known.restitution, known.restitution, 1.0)


def taught(memory: HitMemory, restitution: float, odd: float = 1.0) -> bool:
    """Whether a hit was learned from; it replaces the experience only after a refused hit."""
    contested = "paper" in memory._rivals
    try:
        lesson = memory.learn("paper", strike(memory, restitution, odd), LIMITS, 0.5)
    except ImplausibleHit:
        return False
    assert contested or not lesson.replaced
    return True


def test_an_odd_first_hit_is_corrected_by_the_second_good_one():
    """The first good hit is refused; the second one agrees with it, and both replace the first."""
    memory = HitMemory({})
    assert taught(memory, 0.5, odd=0.8)
    assert strike(memory, 0.5).omega > 1.15 * OMEGA
    assert not taught(memory, 0.5)
    lesson = memory.learn("paper", strike(memory, 0.5), LIMITS, 0.5)
    assert (lesson.replaced, lesson.before.hits, lesson.after.hits) == (True, 1, 2)
    assert taught(memory, 0.5)
    assert strike(memory, 0.5).omega == pytest.approx(OMEGA, rel=0.01)
    assert memory.known["paper"].hits == 3


def test_a_single_odd_hit_does_not_outvote_good_ones():
    """An odd hit between good ones is refused, and leaves no trace."""
    memory, other = HitMemory({}), HitMemory({})
    assert [taught(memory, 0.45, odd) for odd in (1.0, 1.0, 0.8, 1.0, 0.8, 1.0)] == [
        True, True, False, True, False, True]
    assert all(taught(other, 0.45) for _ in range(4))
    assert memory.known["paper"].restitution == other.known["paper"].restitution
    assert memory.known["paper"].mass_factor == other.known["paper"].mass_factor


def test_odd_hits_that_do_not_agree_do_not_outvote_good_ones():
    """Refused hits in a row replace nothing while each contradicts the one before."""
    memory = HitMemory({})
    assert all(taught(memory, 0.5) for _ in range(3))
    assert not any(taught(memory, 0.5, odd) for odd in (0.8, 1.25, 0.8, 1.25, 0.3, 0.8))
    assert memory.known["paper"].hits == 3


def test_a_door_that_has_changed_is_learned_anew():
    """A padded leaf (restitution 0.5, then 0.35) costs one refused hit."""
    memory = HitMemory({})
    assert all(taught(memory, 0.5) for _ in range(5))
    assert [taught(memory, 0.35) for _ in range(3)] == [False, True, True]
    assert strike(memory, 0.35).omega == pytest.approx(OMEGA, rel=0.01)


def test_experience_outside_the_limits_is_replaced_by_the_next_hit():
    """A ruined entry of an older file does not decide what is expected."""
    memory = HitMemory({"paper": replace(Experience.none(0.07), hits=4, mass_factor=1.96)})
    hit = strike(HitMemory({}), 0.48)
    before, after, replaced = memory.learn("paper", hit, LIMITS, 0.5)
    assert not replaced
    assert (before.hits, before.restitution) == (0, 0.5)
    assert after.hits == 1
    assert memory.known["paper"] is after
