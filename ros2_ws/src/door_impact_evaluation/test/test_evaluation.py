"""The evaluation of a run finds contacts, speeds, ZMP, slip and tilt in a log made by hand."""

import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from door_impact_evaluation.errors import DemoError
from door_impact_evaluation.run import evaluation
from door_impact_evaluation.run.record import Motion
from hrp2_description.robot import load_robot_config

ROBOT = load_robot_config()
WEIGHT = ROBOT.mass * GRAVITY


def standing(n: int = 1000, share_left: float = 0.5, **columns: np.ndarray) -> Motion:
    """Makes the log of a robot that stands still, with a share of its weight on the left sole."""
    t = 0.001 * np.arange(n)
    left, right = np.zeros((n, 6)), np.zeros((n, 6))
    left[:, 2], right[:, 2] = share_left * WEIGHT, (1.0 - share_left) * WEIGHT
    zeros = np.zeros(n)
    defaults = {
        "t": t, "left_wrench": left, "right_wrench": right,
        "left_sole": np.tile([0.0, 0.095, 0.0], (n, 1)),
        "right_sole": np.tile([0.0, -0.095, 0.0], (n, 1)),
        "left_heading": np.zeros(n), "right_heading": np.zeros(n),
        "base_orientation": np.tile([0.0, 0.0, 0.0, 1.0], (n, 1)),
        "door_angle": zeros, "door_velocity": zeros, "contact_force": zeros,
        "point_b_velocity": zeros, "joints": np.zeros((n, 30)), "base_position": np.zeros((n, 3)),
        "com": np.zeros((n, 3)),
    }
    return Motion(**{**defaults, **columns})


def hit(omega: float = 0.6, v: float = 0.45, v_post: float = 0.05) -> Motion:
    """Makes the log of a contact of 15 ms at 0.2 s, after which the door opens and falls shut."""
    motion = standing()
    t = motion.t
    touching = (t >= 0.2) & (t < 0.215)
    after = t >= 0.215
    velocity = np.where(after, omega * (1.0 - (t - 0.215) / 0.5), 0.0)
    return standing(
        contact_force=np.where(touching, 1500.0, 0.0),
        door_velocity=velocity,
        door_angle=np.cumsum(velocity) * 0.001,
        point_b_velocity=np.where(after, v_post, v))


def test_two_touches_within_20_ms_are_one_contact_and_beyond_are_two() -> None:
    """A gap of 15 ms does not end a contact, one of 30 ms does."""
    t = 0.001 * np.arange(200)
    for gap, contacts in ((15, 1), (30, 2)):
        force = np.zeros(200)
        force[50:60] = force[60 + gap:70 + gap] = 100.0
        assert len(evaluation.find_contacts(t, force)) == contacts


def test_impact_reads_speeds_before_and_after_the_contact() -> None:
    """Speeds of B and of the door give the coefficient of restitution."""
    motion = hit()
    motion.contact_force[300:320] = 50.0  # the robot touches the opening door again
    found = evaluation.impact(motion, l_b=0.42)
    assert found.contacts_before_peak == 2
    assert found.v_rb == pytest.approx(0.45)
    assert found.v_rb_post == pytest.approx(0.05)
    assert found.omega_door == pytest.approx(0.6)
    assert found.restitution == pytest.approx((0.6 * 0.42 - 0.05) / 0.45)
    assert found.duration == pytest.approx(0.015)


def test_no_contact_is_an_error() -> None:
    """The error says that the robot did not hit the door."""
    with pytest.raises(DemoError, match="did not hit"):
        evaluation.impact(standing(), l_b=0.42)
    with pytest.raises(DemoError, match="did not hit"):  # a touch before the run-up is none
        evaluation.impact(hit(), l_b=0.42, since=float(hit().t[-1]))


def test_even_weight_puts_the_zmp_midway_between_the_feet() -> None:
    """The polygon then reaches to the outer edge of the sole."""
    found = evaluation.support(standing(), ROBOT, window=0.0)
    np.testing.assert_allclose(found.zmp, 0.0, atol=1e-12)
    inner = ROBOT.soles["left"]
    assert found.high[0] == pytest.approx(0.095 + inner[3])


def test_a_sole_with_4_percent_of_the_weight_is_not_in_the_support_polygon() -> None:
    """A sole with 6 percent of the weight is in the polygon."""
    both = evaluation.support(standing(share_left=0.94), ROBOT, window=0.0)
    left = evaluation.support(standing(share_left=0.96), ROBOT, window=0.0)
    assert both.high[0] > 0.0
    assert left.high[0] < 0.0  # towards the door is -y, where the right sole would be
    assert left.margin[0] < both.margin[0]
    tipping = standing()
    tipping.left_wrench[:, 3] = 300.0  # a torque about x that no sole can bear
    assert evaluation.support(tipping, ROBOT, window=0.0).margin.max() < 0.0


def test_zmp_and_margin_turn_with_the_robot() -> None:
    """Where a robot stands and where it points changes neither its margin nor the ZMP on it."""
    turn = 2.4
    cos, sin = np.cos(turn), np.sin(turn)
    turned = np.array([[cos, -sin], [sin, cos]])
    ahead = standing(share_left=0.8)
    ahead.left_wrench[:, 3:5] = [20.0, -30.0]
    n, place = len(ahead.t), np.array([4.0, -7.0])
    columns = {f"{side}_sole": np.column_stack(
        [getattr(ahead, f"{side}_sole")[:, :2] @ turned.T + place, np.zeros(n)])
        for side in ("left", "right")}
    columns |= {f"{side}_heading": np.full(n, turn) for side in ("left", "right")}
    away = standing(left_wrench=ahead.left_wrench, right_wrench=ahead.right_wrench, **columns)
    near, far = (evaluation.support(motion, ROBOT, window=0.0) for motion in (ahead, away))
    np.testing.assert_allclose(far.margin, near.margin, atol=1e-4)  # places are rounded
    np.testing.assert_allclose(far.zmp, near.zmp @ turned.T + place, atol=1e-9)


def test_a_heading_has_no_jump_where_it_passes_half_a_turn() -> None:
    """A whole turn and a half is counted as such, also of a sole that is tilted a little."""
    turn = np.linspace(0.0, 3.0 * np.pi, 400)
    zero = np.zeros(400)
    tilted = np.column_stack([zero + 0.01, zero, np.sin(turn / 2), np.cos(turn / 2)])
    tilted /= np.linalg.norm(tilted, axis=1)[:, None]
    np.testing.assert_allclose(evaluation.heading(tilted), turn, atol=1e-3)


def test_slip_and_tilt_are_measured() -> None:
    """A sole that moves by 3 mm and a base that is tilted by 5 deg are found."""
    motion = standing()
    motion.right_sole[600:, 1] += 0.003
    assert evaluation.slip(motion, 0.5, 0.9) == pytest.approx(0.003)
    half = np.radians(5.0) / 2
    tilted = np.tile([np.sin(half), 0.0, 0.0, np.cos(half)], (4, 1))
    np.testing.assert_allclose(np.degrees(evaluation.tilt(tilted)), 5.0)
