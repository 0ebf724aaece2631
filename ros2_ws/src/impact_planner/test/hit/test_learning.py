"""Learning from hits: accuracy of the next hit, what is refused, the file, and the memory."""

import math
import tempfile
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from door_model.door.config import load_door
from door_model.motion.dynamics import peak
from hypothesis import given, settings
from hypothesis import strategies as st
from impact_planner.errors import ImplausibleHit, InvalidRequest
from impact_planner.hit import momentum
from impact_planner.hit.learning import HitMemory, ObservedHit, learn, require_on_time
from impact_planner.impact_plan import observed_hit
from impact_planner.task.experience import Experience, Limits, load, save
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.settings import PlannerSettings

NEW = Experience.none(0.5)
FORGOTTEN = 0.01**2 * np.eye(2)
# What the first hit of the simulated robot on the paper's door teaches.
ONE_HIT = Experience(1, 1.028, 0.474, np.array([[3.62e-3, -2.81e-3], [-2.81e-3, 2.39e-3]]))
PAPER = {"i_a": 12.75, "l_b": 0.42, "model_mass": 58.0, "braking": 0.07, "factor": 1.0,
         "restitution": 0.5, "measured": True, "apparent": 0.43, "slope": 0.67}

worlds = st.builds(
    dict, i_a=st.floats(8.0, 20.0), l_b=st.floats(0.35, 0.6), model_mass=st.floats(40.0, 65.0),
    braking=st.floats(0.0, 0.2), factor=st.floats(0.8, 1.25), restitution=st.floats(0.35, 0.65),
    measured=st.booleans(), apparent=st.floats(0.35, 0.5), slope=st.floats(0.45, 0.85))
speeds = st.floats(0.3, 1.2)


def apparent(restitution: float, world: dict) -> float:
    """Apparent restitution of a hit on a surface."""
    return world["apparent"] + world["slope"] * (restitution - 0.5)


def struck(known: Experience, omega: float, world: dict) -> ObservedHit:
    """A hit on the true door that was planned for w' with the present experience."""
    law = {name: world[name] for name in ("i_a", "l_b", "braking")}
    mass = world["model_mass"]
    planned, true = (
        apparent(each, world) for each in (known.restitution, world["restitution"]))
    v_rb = momentum.speeds_for(
        omega, effective_mass=known.mass_factor * mass, restitution=planned, **law).v_rb
    real = momentum.omega_for(
        v_rb, effective_mass=world["factor"] * mass, restitution=true, **law)
    v_post = real * law["l_b"] - true * v_rb if world["measured"] else math.nan
    return ObservedHit(
        mass, law["i_a"], law["l_b"], v_rb, v_post, real, law["braking"], known.restitution,
        planned, world["slope"])


def a_hit(**changes: float) -> ObservedHit:
    """A hit on the paper's door that went as planned, with given changes."""
    return replace(struck(NEW, 0.635, PAPER), **changes)


@given(worlds, speeds, st.floats(0.6, 1.6))
def test_hits_converge(world, omega, other):
    """One corrects 30 % in mass and 0.15 in restitution to 1 % in w', five to 0.1 %.

    Another w' (0.6 to 1.6 times) is then right to 0.5 %.
    """
    known = NEW
    for number, error in enumerate((1e-2, 1.0, 1.0, 1.0, 1e-3), 1):
        known = learn(known, struck(known, omega, world))
        assert known.hits == number
        assert struck(known, omega, world).omega == pytest.approx(omega, rel=error)
    assert struck(known, other * omega, world).omega == pytest.approx(other * omega, rel=5e-3)


@given(worlds, speeds)
def test_a_hit_makes_surer_and_never_certain(world, omega):
    """Each hit reduces the covariance in a direction, and no variance becomes zero."""
    known = NEW
    for number in range(6):
        prior = known.covariance + FORGOTTEN * (number > 0)
        known = learn(known, struck(known, omega, world))
        assert np.array_equal(known.covariance, known.covariance.T)
        assert np.linalg.eigvalsh(known.covariance)[0] > 0.0
        shrunk = np.linalg.eigvalsh(prior - known.covariance)
        assert shrunk[0] > -1e-12
        assert shrunk[1] > 1e-5


@pytest.mark.parametrize("before", [NEW, ONE_HIT])
@given(v_post=st.floats(-0.5, 0.5) | st.just(math.nan))
def test_a_contact_that_was_detected_too_early_is_refused(before, v_post):
    """A peak of 10 deg after a false contact, planned for 25 deg, taught e = 0 and 2.1 m_re."""
    early = struck(before, 0.6347, PAPER)
    omega = _told(load_door("paper"), 0.0, math.radians(10.0)).omega
    for changes in ({"omega": omega, "v_rb_post": v_post}, {"v_rb_post": early.v_rb_post + 0.3},
                    {"omega": math.nan}):
        with pytest.raises(ImplausibleHit):
            learn(before, replace(early, **changes))
    assert learn(before, early).hits == before.hits + 1


@pytest.mark.parametrize(("changes", "reason"), [
    ({"contact_delay": -0.067}, ""), ({"switch_latency": 0.021}, ""),
    ({"contact_delay": math.nan}, "contact_delay"), ({"contact_delay": 0.069}, "contact_delay"),
    ({"switch_latency": 0.023}, "switch_latency")])
def test_a_contact_or_a_switch_at_the_wrong_time_is_refused(changes, reason):
    """A contact may be 58 ms early or late, within the steady run-up; the switch at most 10 ms."""
    times = {"contact_delay": 0.0, "switch_latency": 0.012, "steady_time": 0.058,
             "switch_delay": 0.012} | changes
    if not reason:
        require_on_time(**times)
        return
    with pytest.raises(ImplausibleHit, match=reason):
        require_on_time(**times)
    with pytest.raises(ImplausibleHit, match=reason):
        _told(load_door("paper"), 0.0, 0.4, **changes)


def _told(door, initial, angle, **changes):
    """The observed hit of a door that opened from an initial angle to another angle [rad]."""
    plan = SimpleNamespace(
        initial_angle=initial, effective_mass_model=58.0, l_b=0.42, v_rb=0.4, v_com=0.34,
        braking=0.07, settings=PlannerSettings(), restitution=0.5,
        hit=SimpleNamespace(transfer=SimpleNamespace(
            response=SimpleNamespace(restitution=0.43), restitution_slope=0.67)))
    measured = {"contact_delay": 0.005, "switch_latency": 0.012, "v_rb_post": 0.05,
                "peak_angle": angle}
    return observed_hit(plan, KnownDoor.configured(door), SimpleNamespace(**measured | changes))


@given(st.sampled_from(["paper", "size3"]), st.floats(0.0, 0.3), st.floats(0.02, 0.4))
def test_the_peak_tells_the_speed_from_the_angle_of_the_hit_on(name, initial, way):
    """The observed w' opens the door from the angle of the hit to the measured peak."""
    config = load_door(name)
    hit = _told(config, initial, initial + way)
    assert peak(config.door(), initial, hit.omega).angle == pytest.approx(initial + way, abs=1e-6)


experiences = st.builds(
    lambda hits, factor, e, a, b, r: Experience(
        hits, factor, e, np.array([[a * a, r * a * b], [r * a * b, b * b]])),
    st.integers(1, 1000), st.floats(0.3, 3.0), st.floats(0.0, 1.0), st.floats(1e-6, 1.0),
    st.floats(1e-6, 1.0), st.floats(-0.95, 0.95))


@cache
def often() -> Experience:
    """What 200 hits teach; rounding must not make its covariance impossible."""
    known = NEW
    for number in range(200):
        known = learn(known, a_hit(omega=0.635 + 0.001 * (number % 7)))
    return known


@settings(max_examples=5)
@given(st.dictionaries(st.text(), experiences, max_size=4))
def test_what_is_saved_is_loaded_to_the_bit(known):
    """Any numbers and any names of doors, such as `null`, and what 200 hits have taught."""
    known |= {"paper": often()}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "deep" / "experience.yaml"
        save(path, known)
        again = load(path)
        assert list(path.parent.iterdir()) == [path]
    assert again.keys() == known.keys()
    for door, one in known.items():
        for name in ("hits", "mass_factor", "restitution"):
            assert getattr(again[door], name) == getattr(one, name)
        np.testing.assert_array_equal(again[door].covariance, one.covariance)


@pytest.mark.parametrize("content", [b"paper: {hits: 1\n", b"paper: {hits: 1, mass_factor: .nan, "
                                     b"restitution: 0.5, covariance: [[0.1, 0], [0, 0.1]]}\n"])
def test_a_file_of_something_else_is_refused_by_name_and_kept(tmp_path, content):
    path = tmp_path / "precious.yaml"
    path.write_bytes(content)
    with pytest.raises(InvalidRequest, match=r"precious\.yaml"):
        load(path)
    assert path.read_bytes() == content


# -- what hits have taught: an odd hit does not outvote it, and two hits that agree do -----------

OMEGA, LIMITS = 0.635, Limits()


def strike(memory: HitMemory, restitution: float, odd: float = 1.0) -> ObservedHit:
    """A hit that is planned for 0.635 rad/s by what was learned; `odd` is a factor on w'."""
    known = memory.known.get("paper", NEW)
    hit = struck(known, OMEGA, PAPER | {
        "restitution": restitution, "measured": False, "apparent": 0.5, "slope": 1.0})
    return replace(hit, omega=odd * hit.omega)


def taught(memory: HitMemory, restitution: float, odd: float = 1.0) -> bool:
    """Whether a hit was learned from."""
    try:
        memory.learn("paper", strike(memory, restitution, odd), LIMITS, 0.5)
    except ImplausibleHit:
        return False
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


def test_odd_hits_that_do_not_agree_do_not_outvote_good_ones():
    """One between good hits leaves no trace; in a row each contradicts the one before."""
    memory, other = HitMemory({}), HitMemory({})
    assert [taught(memory, 0.45, odd) for odd in (1.0, 1.0, 0.8, 1.0, 0.8, 1.0)] == [
        True, True, False, True, False, True]
    assert all(taught(other, 0.45) for _ in range(4))
    assert memory.known["paper"].restitution == other.known["paper"].restitution
    assert memory.known["paper"].mass_factor == other.known["paper"].mass_factor
    assert not any(taught(memory, 0.45, odd) for odd in (0.8, 1.25, 0.8, 1.25, 0.3, 0.8))
    assert memory.known["paper"].hits == 4


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
