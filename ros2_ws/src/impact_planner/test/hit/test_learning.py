"""Learning from hits: accuracy of the next hit, refusal of nonsense, and the file."""

import errno
import math
import tempfile
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from door_impact_common.errors import OutputError
from door_model.door.config import load_door
from door_model.errors import DoorModelError
from door_model.motion.dynamics import peak
from hypothesis import given, settings
from hypothesis import strategies as st
from impact_planner.errors import ImplausibleHit, InvalidRequest
from impact_planner.hit import momentum
from impact_planner.hit.learning import ObservedHit, learn, require_on_time
from impact_planner.impact_plan import observed_hit
from impact_planner.task.experience import Experience, Limits, load, save
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.settings import PlannerSettings

NEW = Experience.none(0.5)
FORGOTTEN = 0.01**2 * np.eye(2)
SOUND = Experience(2, 1.1, 0.45, np.array([[2e-3, -5e-4], [-5e-4, 1e-5 + 3e-3]]))
# What the first hit of the simulated robot on the paper's door teaches.
ONE_HIT = Experience(1, 1.028, 0.474, np.array([[3.62e-3, -2.81e-3], [-2.81e-3, 2.39e-3]]))
PAPER = {"i_a": 12.75, "l_b": 0.42, "model_mass": 58.0, "braking": 0.07, "factor": 1.0,
         "restitution": 0.5, "measured": True, "apparent": 0.43, "slope": 0.67}
ENTRY = {"hits": 1, "mass_factor": 1.0, "restitution": 0.5, "covariance": "[[0.1, 0], [0, 0.1]]"}

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


@given(worlds, speeds)
def test_the_hit_after_one_is_right_to_one_percent(world, omega):
    """One hit corrects errors of 30 % in mass and 0.15 in restitution to 1 % in w'."""
    after = learn(NEW, struck(NEW, omega, world))
    assert after.hits == 1
    assert struck(after, omega, world).omega == pytest.approx(omega, rel=1e-2)


@given(worlds, speeds, st.floats(0.6, 1.6))
def test_more_hits_converge(world, omega, other):
    """After five hits w' is right to 0.1 %, and another w' (0.6 to 1.6 times) to 0.5 %."""
    known = NEW
    for _ in range(5):
        known = learn(known, struck(known, omega, world))
    assert known.hits == 5
    assert struck(known, omega, world).omega == pytest.approx(omega, rel=1e-3)
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


@pytest.mark.parametrize("changes", [
    {"omega": math.nan}, {"omega": 0.0}, {"omega": 0.635 * 30.0}, {"v_rb_post": 1e200}])
def test_a_hit_that_makes_no_sense_changes_nothing(changes):
    """An implausible hit is refused, whereas the hit itself is accepted."""
    assert learn(SOUND, a_hit()).hits == SOUND.hits + 1
    with pytest.raises(ImplausibleHit):
        learn(SOUND, a_hit(**changes))


@pytest.mark.parametrize("before", [NEW, ONE_HIT])
@given(v_post=st.floats(-0.5, 0.5) | st.just(math.nan))
def test_a_contact_that_was_detected_too_early_is_refused(before, v_post):
    """A peak of 10 deg after a false contact, planned for 25 deg, taught e = 0 and 2.1 m_re."""
    peak, planned = _told(load_door("paper"), 0.0, math.radians(10.0)), 0.6347
    hit = replace(struck(before, planned, PAPER), omega=peak.omega, v_rb_post=v_post)
    with pytest.raises(ImplausibleHit, match="normalised innovation squared") as caught:
        learn(before, hit)
    assert caught.value.value > caught.value.limit


@pytest.mark.parametrize("before", [NEW, ONE_HIT])
def test_a_speed_that_does_not_fit_the_peak_is_refused(before):
    """A planned peak with v'_rB 0.3 m/s above its expected value is refused."""
    hit = struck(before, 0.6347, PAPER)
    good = learn(before, hit)
    with pytest.raises(ImplausibleHit, match="normalised innovation squared"):
        learn(before, replace(hit, v_rb_post=hit.v_rb_post + 0.3))
    assert good.hits == before.hits + 1


@pytest.mark.nightly("statistics of 4000 hits")
@pytest.mark.parametrize("measured", [True, False])
def test_of_the_hits_that_the_filter_expects_one_in_a_thousand_is_refused(measured):
    """Mass, restitution and noise drawn as the filter assumes: 1 to 12 of 4000 hits are refused."""
    random, refused = np.random.default_rng(5), 0
    for _ in range(4000):
        factor, restitution = math.exp(0.1 * random.normal()), 0.5 + 0.1 * random.normal()
        hit = struck(NEW, 0.635, PAPER | {
            "factor": factor, "restitution": restitution, "measured": measured})
        hit = replace(hit, omega=hit.omega * math.exp(0.01 * random.normal()),
                      v_rb_post=hit.v_rb_post + 0.03 * random.normal())
        try:
            learn(NEW, hit)
        except ImplausibleHit:
            refused += 1
    assert 1 <= refused <= 12


@given(st.lists(st.builds(a_hit, omega=st.floats(0.3, 1.2), v_rb_post=st.floats(-0.5, 0.5)),
                min_size=20, max_size=20),
       st.floats(0.3, 1.0), st.floats(1.0, 1.5), st.floats(0.1, 0.5), st.floats(0.5, 0.9))
def test_whatever_hits_show_is_learned_within_the_limits(hits, light, heavy, soft, hard):
    """Twenty hits of any peak and speed never lead beyond configured limits."""
    limits, known = Limits((light, heavy), (soft, hard)), NEW
    for hit in hits:
        try:
            known = learn(known, hit, limits)
        except ImplausibleHit:
            continue
        assert known.outside(limits) == ""
        assert np.linalg.eigvalsh(known.covariance)[0] > 0.0


ON_TIME = {"contact_delay": 0.0, "switch_latency": 0.012}


@pytest.mark.parametrize(("changes", "reason"), [
    ({"contact_delay": math.nan}, "contact_delay"), ({"contact_delay": 0.069}, "contact_delay"),
    ({"switch_latency": 0.023}, "switch_latency")])
def test_a_contact_or_a_switch_at_the_wrong_time_is_refused(changes, reason):
    """A contact may be 58 ms early or late, within the steady run-up; the switch at most 10 ms."""
    plan = {"steady_time": 0.058, "switch_delay": 0.012}
    for good in ({}, {"contact_delay": -0.067}, {"contact_delay": 0.067},
                 {"switch_latency": 0.021}):
        require_on_time(**ON_TIME | good, **plan)
    with pytest.raises(ImplausibleHit, match=reason):
        require_on_time(**ON_TIME | changes, **plan)
    with pytest.raises(ImplausibleHit, match=reason):
        _told(load_door("paper"), 0.0, 0.4, **changes)


def test_v_post_that_is_no_number_is_left_out():
    """Without a finite v'_rB, the hit is learned from its angle alone."""
    after = learn(NEW, a_hit(v_rb_post=math.nan, omega=0.7))
    assert after.mass_factor > 1.0 < after.restitution / 0.5
    speeds = momentum.speeds_for(
        0.7, i_a=12.75, l_b=0.42, effective_mass=58.0 * after.mass_factor,
        restitution=apparent(after.restitution, PAPER), braking=0.07)
    assert speeds.v_rb == pytest.approx(a_hit().v_rb, rel=2e-3)


def _told(door, initial, angle, **changes):
    """The observed hit of a door that opened from an initial angle to another angle [rad]."""
    plan = SimpleNamespace(
        initial_angle=initial, effective_mass_model=58.0, l_b=0.42, v_rb=0.4, v_com=0.34,
        braking=0.07, settings=PlannerSettings(), restitution=0.5,
        hit=SimpleNamespace(transfer=SimpleNamespace(
            model_restitution=0.43, restitution_slope=0.67)))
    measured = {"contact_delay": 0.005, "switch_latency": 0.012, "v_rb_post": 0.05,
                "peak_angle": angle}
    return observed_hit(plan, KnownDoor.configured(door), SimpleNamespace(**measured | changes))


@given(st.sampled_from(["paper", "size3"]), st.floats(0.0, 0.3), st.floats(0.02, 0.4))
def test_the_peak_tells_the_speed_from_the_angle_of_the_hit_on(name, initial, way):
    """The observed w' opens the door from the angle of the hit to the measured peak."""
    config = load_door(name)
    hit = _told(config, initial, initial + way)
    assert peak(config.door(), initial, hit.omega).angle == pytest.approx(initial + way, abs=1e-6)


@pytest.mark.parametrize("degrees", [math.nan, 5.0, 170.0])
def test_an_angle_to_which_the_door_cannot_have_opened_is_an_error(degrees):
    """Angles that are not finite, not beyond the hit's 5 deg or beyond the linkage are errors."""
    with pytest.raises(DoorModelError):
        _told(load_door("paper"), math.radians(5.0), math.radians(degrees))


experiences = st.builds(
    lambda hits, factor, e, a, b, r: Experience(
        hits, factor, e, np.array([[a * a, r * a * b], [r * a * b, b * b]])),
    st.integers(1, 1000), st.floats(0.3, 3.0), st.floats(0.0, 1.0), st.floats(1e-6, 1.0),
    st.floats(1e-6, 1.0), st.floats(-0.95, 0.95))


@settings(max_examples=5)
@given(st.dictionaries(st.text(), experiences, max_size=4))
def test_what_is_saved_is_loaded_to_the_bit(known):
    """Any numbers and any names of doors, such as `null`, survive the file exactly."""
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


def test_what_many_hits_taught_can_be_loaded_again(tmp_path):
    """Rounding in a long series of hits makes no covariance that `load` refuses."""
    known = NEW
    for number in range(200):
        known = learn(known, a_hit(omega=0.635 + 0.001 * (number % 7)))
    save(tmp_path / "e.yaml", {"paper": known})
    assert load(tmp_path / "e.yaml")["paper"].hits == 200


def test_no_file_and_an_empty_one_hold_nothing(tmp_path):
    """A missing or empty file holds no experience, and loading creates no file."""
    assert load(tmp_path / "none.yaml") == {}
    assert not list(tmp_path.iterdir())
    (tmp_path / "empty.yaml").write_text("# nothing yet\n")
    assert load(tmp_path / "empty.yaml") == {}


def _entry(**changes: object) -> bytes:
    """The content of a file with one entry and given changes."""
    entry = {name: value for name, value in (ENTRY | changes).items() if value is not None}
    return ("paper:\n" + "".join(f"  {k}: {v}\n" for k, v in entry.items())).encode()


@pytest.mark.parametrize("content", [
    b"just some words\n", b"paper: {hits: 1\n", _entry(speed=1.0), _entry(restitution=2),
    _entry(mass_factor=".nan"), _entry(hits=1.5), _entry(covariance="[[0.1, 0.2], [0.2, 0.1]]")])
def test_a_file_of_something_else_is_refused_by_name_and_kept(tmp_path, content):
    """A file with any invalid content is refused by its name and not changed."""
    path = tmp_path / "precious.yaml"
    path.write_bytes(content)
    with pytest.raises(InvalidRequest, match=r"precious\.yaml") as caught:
        load(path)
    assert caught.value.value == str(path)
    assert path.read_bytes() == content
    assert list(tmp_path.iterdir()) == [path]


def test_a_write_that_fails_leaves_the_old_file(tmp_path, monkeypatch):
    """A write that fails half way, on a full disk, leaves the old file."""
    path = tmp_path / "experience.yaml"
    save(path, {"paper": SOUND})
    before = path.read_bytes()

    def half(self: Path, content: bytes) -> int:
        with self.open("wb") as file:
            file.write(content[: len(content) // 2])
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_bytes", half)
        with pytest.raises(OutputError, match="No space"):
            save(path, {"paper": NEW, "size2": SOUND})
    assert path.read_bytes() == before
    save(path, {"size2": SOUND})
    assert list(load(path)) == ["size2"]
