import numpy as np
import pytest
from door_impact_common.errors import SettingError
from door_model.door.config import load_door
from door_model.door.surface import reduced_mass
from hrp2_sim_bridge.benches.drop_bench import drop_test
from hrp2_sim_bridge.physics.contact import design_contact, simulate_impact
from hrp2_sim_bridge.settings import ENGINES
from hypothesis import given, settings
from hypothesis import strategies as st

BALL, L_B, STEP = 47.0, 0.42, 0.00025


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(("restitution", "speed"), [(0.0, 0.5), (0.3, 0.9), (0.7, 0.2)])
def test_free_ball_leaves_the_leaf_with_the_restitution_asked_for(
    engine, restitution, speed
) -> None:
    """A free ball leaves the leaf with the wanted restitution, and momentum is conserved."""
    door = load_door("paper")
    design = design_contact(restitution, reduced_mass(BALL, door.i_a / L_B**2), 0.015, STEP)
    shown = drop_test(door, design, mass=BALL, lever=L_B, speed=speed, step=STEP, engine=engine)
    assert shown.restitution == pytest.approx(restitution, abs=0.01)
    assert shown.momentum_ratio == pytest.approx(1.0, abs=0.001)
    if restitution:
        assert 0.010 < shown.duration < 0.020


def test_a_ball_that_slides_along_the_leaf_leaves_it_as_fast() -> None:
    """Friction turns the ball, but does not change the speed at which it leaves the leaf."""
    door = load_door("paper")
    design = design_contact(0.5, reduced_mass(BALL, door.i_a / L_B**2), 0.015, STEP)
    straight, *slid = (
        drop_test(
            door, design, mass=BALL, lever=L_B, speed=0.5, step=STEP, sliding=sliding).restitution
        for sliding in (0.0, 0.1, 0.3))
    np.testing.assert_allclose(slid, straight, atol=0.002)


@settings(max_examples=5)
@given(st.floats(0.05, 0.85), st.floats(5.0, 80.0), st.floats(0.008, 0.03))
def test_design_meets_restitution_and_duration(restitution, mass, duration) -> None:
    """The designed surface has the wanted restitution and duration."""
    design = design_contact(restitution, mass, duration, STEP)
    assert design.restitution == pytest.approx(restitution, abs=1e-3)
    assert design.duration == pytest.approx(duration, rel=0.05)
    assert design.stiffness > 0.0
    assert design.damping >= 0.0


@pytest.mark.parametrize(("frequency", "ratio"), [(200.0, 0.3), (100.0, 1.0)])
def test_scheme_converges_to_the_exact_spring_damper_that_cannot_pull(frequency, ratio) -> None:
    """With small steps the restitution is the exact one of v' = -2 z w v - w^2 x without pull."""
    shown, _ = simulate_impact(frequency, ratio, 2e-6)
    if ratio < 1.0:
        root = np.sqrt(1.0 - ratio**2)
        angle = np.arctan2(2 * ratio * root, 2 * ratio**2 - 1)
        exact = np.exp(-ratio / root * angle)
    else:
        exact = np.exp(-2.0)
    assert shown == pytest.approx(exact, abs=0.01)


@pytest.mark.parametrize("bad", [0.99, float("nan")])
def test_restitution_out_of_reach_is_an_error_that_names_it(bad) -> None:
    """A restitution that cannot be reached is an error that names it."""
    with pytest.raises(SettingError) as error:
        design_contact(bad, 28.0, 0.015, STEP)
    assert error.value.setting == "restitution"
