"""Eqs. (2) to (5) with restitution."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from impact_planner.hit import momentum

positive = st.floats(0.05, 50.0)
shares = st.floats(0.0, 1.0)


def test_the_papers_robot():
    """The paper's 58 kg, I_rob 6.147 and b_r 0.71 m give a_r = 0.149 m and m_re = 47.92 kg."""
    assert momentum.percussion_height(58.0, 6.147, 0.1493) == pytest.approx(0.71, abs=5e-4)
    assert momentum.effective_mass_planar(58.0, 6.147, 0.1493) == pytest.approx(47.92, abs=0.01)
    assert momentum.effective_mass_planar(58.0, 6.147, 0.0) == 58.0


def test_worked_example_with_the_papers_door():
    """w' = 0.635 rad/s, e = 0.5 and 46.6 kg give v_rB = 0.453 and v'_rB = 0.04 m/s."""
    found = momentum.speeds_for(0.635, i_a=12.75, l_b=0.42, effective_mass=46.6, restitution=0.5)
    assert found.v_rb == pytest.approx(0.4535, abs=1e-3)
    assert found.v_rb_post == pytest.approx(0.040, abs=1e-3)
    assert found.impulse == pytest.approx(19.28, abs=0.01)


@given(positive, positive, st.floats(0.05, 2.0), positive, shares)
def test_a_hit_never_makes_energy(omega, i_a, l_b, mass, e):
    """Kinetic energy never increases in the hit, and is equal for e = 1."""
    found = momentum.speeds_for(omega, i_a=i_a, l_b=l_b, effective_mass=mass, restitution=e)
    before = 0.5 * mass * found.v_rb**2
    after = 0.5 * mass * found.v_rb_post**2 + 0.5 * i_a * omega**2
    assert after <= before * (1.0 + 1e-9)
    elastic = momentum.speeds_for(omega, i_a=i_a, l_b=l_b, effective_mass=mass, restitution=1.0)
    assert 0.5 * mass * elastic.v_rb_post**2 + 0.5 * i_a * omega**2 == pytest.approx(
        0.5 * mass * elastic.v_rb**2, rel=1e-9
    )


@given(mass=st.floats(20.0, 120.0), i_rob=st.floats(2.0, 20.0), a_r=st.floats(0.05, 0.4),
       b_r=st.floats(0.4, 1.0))
def test_a_rigid_robot_that_turns_about_c_needs_this_impulse_there(mass, i_rob, a_r, b_r):
    """The impulse at C satisfies linear and angular momentum, and is 0 where eq. (5) holds."""
    foot = momentum.foot_impulse_planar(mass, i_rob, a_r, b_r)
    v_com, spin = (foot - 1.0) / mass, (-a_r - b_r * foot) / i_rob
    assert v_com - b_r * spin == pytest.approx(0.0, abs=1e-12)
    held = momentum.foot_impulse_planar(
        mass, i_rob, a_r, momentum.percussion_height(mass, i_rob, a_r))
    assert held == pytest.approx(0.0, abs=1e-12)


@given(positive, positive, st.floats(0.05, 2.0), positive, shares, st.floats(0.0, 5.0))
def test_omega_for_inverts_speeds_for_with_a_closer_that_brakes(omega, i_a, l_b, mass, e, braking):
    """With a closer, w' is recovered, and the robot loses what door and closer gain."""
    law = {"i_a": i_a, "l_b": l_b, "effective_mass": mass, "restitution": e, "braking": braking}
    found = momentum.speeds_for(omega, **law)
    assert momentum.omega_for(found.v_rb, **law) == pytest.approx(omega, rel=1e-9)
    lost = mass * (found.v_rb - found.v_rb_post)
    assert lost == pytest.approx(found.impulse, rel=1e-9, abs=1e-9)
    assert lost * l_b == pytest.approx(i_a * omega + braking, rel=1e-9, abs=1e-9)
    assert omega * l_b - found.v_rb_post == pytest.approx(e * found.v_rb, rel=1e-9, abs=1e-9)
