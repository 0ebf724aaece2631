"""The linkage of the closer, eqs. (7) to (9)."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from door_model.door.closer import FourBarCloser
from door_model.errors import DoorParameterError, LinkageError
from hypothesis import given, reject
from hypothesis import strategies as st

PAPER = FourBarCloser(0.195, 0.204, 0.220, 0.265, 0.34)


@pytest.mark.parametrize(
    ("degrees", "f", "eta"), [(0, -17.79, 3.199), (25, 26.30, 1.240), (90, 91.69, 0.873)]
)
def test_figures_of_the_paper(degrees: float, f: float, eta: float) -> None:
    """The linkage of appendix B has the known angles and ratios."""
    theta = math.radians(degrees)
    assert math.degrees(PAPER.f(theta)) == pytest.approx(f, abs=0.006)
    assert PAPER.eta(theta) == pytest.approx(eta, abs=6e-4)


def test_eq8_as_printed() -> None:
    """The form with arctan2 equals the form with arccos that the paper prints."""
    c = PAPER
    theta = np.linspace(-0.1, math.pi - c.theta_i0 - 1e-3, 200)
    cos_phi = np.cos(theta + c.theta_i0)
    d2 = c.l**2 + c.l1**2 - 2 * c.l1 * c.l * cos_phi
    printed = (
        math.pi
        - np.arccos((c.l1 - c.l * cos_phi) / np.sqrt(d2))
        - np.arccos((d2 + c.l2**2 - c.l3**2) / (2 * c.l2 * np.sqrt(d2)))
    )
    np.testing.assert_allclose(c.f(theta), printed, atol=1e-9)


lengths = st.floats(0.1, 0.4)
linkages = st.builds(
    FourBarCloser, lengths, lengths, lengths, lengths, theta_i0=st.floats(0.1, 1.5),
    assembly=st.sampled_from([1, -1]))


def angle_at(closer: FourBarCloser, share: float) -> float:
    """A share of the opening range, if the linkage closes at the closed door."""
    try:
        return share * closer.opening_limit()
    except LinkageError:
        reject()


@given(closer=linkages, share=st.floats(0.02, 0.98))
def test_eta_and_its_slope_are_the_derivatives_of_f(closer: FourBarCloser, share: float) -> None:
    """For any linkage and mode, by central differences away from the ends of the range."""
    theta = angle_at(closer, share)
    slope = (closer.f(theta + 1e-7) - closer.f(theta - 1e-7)) / 2e-7
    curve = (closer.eta(theta + 1e-6) - closer.eta(theta - 1e-6)) / 2e-6
    _, eta, slope_of_eta = closer.f_eta_slope(theta)
    assert slope == pytest.approx(eta, rel=1e-3, abs=1e-3)
    assert curve == pytest.approx(slope_of_eta, rel=1e-3, abs=1e-3)


@given(closer=linkages, share=st.floats(0, 0.98))
def test_both_modes_put_the_same_links_together(closer: FourBarCloser, share: float) -> None:
    """In both modes f is the angle of a link 2 with which links 2 and 3 have their lengths."""
    theta = angle_at(closer, share)
    f = closer.f(theta)
    # Link 1 turns about the origin, link 2 from its end by the closer's angle, link 3 comes back.
    phi = theta + closer.theta_i0
    end1 = closer.l1 * np.array([math.cos(phi), math.sin(phi)])
    end2 = end1 + closer.l2 * np.array([math.cos(phi - f), math.sin(phi - f)])
    back = math.hypot(*(end2 - np.array([closer.l, 0.0])))
    assert back == pytest.approx(closer.l3, abs=1e-9)


def test_dead_centre_is_where_the_closer_turns_round() -> None:
    """The mirrored mode of the paper's links has a dead centre, where f is extreme."""
    assert PAPER.dead_centre() is None
    mirrored = replace(PAPER, assembly=-1)
    angle = mirrored.dead_centre()
    assert angle is not None
    around = mirrored.f(angle + np.array([-0.01, 0.0, 0.01]))
    assert around[1] < min(around[0], around[2])
    assert abs(mirrored.eta(angle)) < 1e-9


@pytest.mark.parametrize(("closer", "upper", "lower"), [
    (PAPER, "l1", "l3"), (replace(PAPER, l2=0.12, l3=0.15), "l2 + l3", "l3")])
def test_the_linkage_closes_up_to_its_limits_and_the_link_that_ends_it_is_named(
    closer: FourBarCloser, upper: str, lower: str
) -> None:
    """An angle just beyond either end causes an error with link, angle and element."""
    low, high = closer.closing_limit(), closer.opening_limit()
    assert np.isfinite(closer.f(np.linspace(low + 1e-5, high - 1e-5, 50))).all()
    for angle, link in ((high + 1e-3, upper), (low - 1e-3, lower)):
        with pytest.raises(LinkageError, match=r"element \[1, 0\]") as caught:
            closer.require_within([[0.0], [angle]])
        assert caught.value.theta == angle
        assert caught.value.link == link


@pytest.mark.parametrize(("make", "name"), [
    (lambda: replace(PAPER, l2=math.nan), "l2"), (lambda: replace(PAPER, assembly=2), "assembly"),
    (lambda: PAPER.f(math.nan), "theta")])
def test_lengths_modes_and_angles_that_are_none_are_refused_by_name(
    make: Callable[[], object], name: str
) -> None:
    with pytest.raises(DoorParameterError, match=name):
        make()
