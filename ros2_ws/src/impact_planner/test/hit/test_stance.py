"""Stance and posture at the hit, sections II.C.1 and II.C.4."""

import numpy as np
import pytest
from humanoid_motion.errors import PostureUnreachable
from humanoid_motion.leaf import LeafFrame
from hypothesis import given
from hypothesis import strategies as st
from impact_planner.hit import momentum
from impact_planner.hit.stance import (
    contact_with_leaf,
    door_distances,
    elbow_y_at_contact,
    initial_base,
    initial_feet,
    stance_for_contact,
    stance_for_step,
)


def test_origin_of_odom_is_midway_between_the_soles_on_the_floor(robot):
    """In half-sitting, odom is midway between the soles and base_link at its known height."""
    feet = initial_feet(robot)
    np.testing.assert_allclose(feet["left"] + feet["right"], 0.0, atol=1e-12)
    q = robot.configuration(initial_base(robot), robot.config.half_sitting)
    np.testing.assert_allclose(robot.frame_position(q, "l_sole"), feet["left"], atol=1e-12)
    assert initial_base(robot)[2] == pytest.approx(0.648702, abs=1e-6)


def test_nominal_posture_has_its_center_of_percussion_on_the_floor(robot, stance):
    """Eq. (5) is met with a_r of about 0.18 m and b_r of 0.74 to 0.75 m."""
    posture = stance.posture
    assert posture.percussion_error == pytest.approx(0.0, abs=1e-5)
    assert posture.b_r == pytest.approx(posture.b_r_percussion, abs=1e-5)
    assert posture.b_r == pytest.approx(
        momentum.percussion_height(robot.mass, posture.i_rob, posture.a_r), abs=1e-5
    )
    assert posture.a_r == pytest.approx(posture.elbow[2] - posture.com[2])
    assert 0.16 < posture.a_r < 0.20
    assert 0.72 < posture.b_r < 0.77
    assert 7.0 < posture.i_rob < 8.5


def test_elbow_is_the_outermost_body(robot, stance):
    """The elbow is 2 cm nearer to the door than hand, forearm and foot."""
    q = robot.configuration(stance.posture.base, stance.posture.joints)
    first = stance.posture.elbow[1] - robot.config.contact_radius
    for frame, radius in (("r_gripper", robot.hand_radius), ("RARM_LINK4", 0.04)):
        assert robot.frame_position(q, frame)[1] - radius > first + 0.02
    sole = robot.feet["right"].corners(stance.feet["right"])[:, 1].min()
    assert sole > first + 0.02


def test_com_is_so_far_inside_the_right_sole_s_inner_edge(robot):
    """The CoM has the given distance inside the sole's inner edge, point C of Fig. 5."""
    stance = stance_for_step(robot, 0.2, 0.03)
    inner = robot.feet["right"].corners(stance.feet["right"])[:, 1].max()
    assert stance.posture.com[1] == pytest.approx(inner - 0.03, abs=1e-8)


@given(st.floats(-0.72, -0.64))
def test_elbow_touches_where_it_is_asked_to(robot, elbow_y):
    """The step brings the elbow to the requested place and keeps its limits."""
    stance = stance_for_contact(robot, elbow_y, 0.01)
    assert stance.posture.elbow[1] == pytest.approx(elbow_y, abs=1e-4)
    allowed = robot.config.step
    assert allowed.shortest <= stance.step <= allowed.longest


def test_doors_within_the_named_range_are_reached(robot):
    near, far = door_distances(robot, 0.01, 0.01)
    for distance in np.linspace(near + 0.005, far - 0.005, 5):
        elbow_y = robot.config.contact_radius - distance
        assert stance_for_contact(robot, elbow_y, 0.01).posture.elbow[1] == pytest.approx(
            elbow_y, abs=1e-6)
    for distance in (near - 0.02, far + 0.02):
        with pytest.raises(PostureUnreachable, match="out of reach"):
            stance_for_contact(robot, robot.config.contact_radius - distance, 0.01)


@given(st.floats(0.0, 0.4), st.floats(-0.5, 0.0), st.floats(-0.9, -0.6))
def test_the_elbow_touches_the_open_leaf_at_one_point(angle, hinge_x, hinge_y):
    """The sphere is tangent to the leaf: B lies on the face, one radius from the centre."""
    hinge = np.array([hinge_x, hinge_y])
    y = elbow_y_at_contact(0.02, 0.05, hinge, angle)
    elbow = np.array([0.02, y, 0.9])
    contact = contact_with_leaf(elbow, 0.05, hinge, angle)
    leaf = LeafFrame(hinge, angle)
    assert leaf.gap(elbow) == pytest.approx(0.05)
    assert leaf.gap(contact.point) == pytest.approx(0.0, abs=1e-12)
    assert leaf.radius(contact.point) == pytest.approx(contact.l_b)
    np.testing.assert_allclose(leaf.point(contact.l_b, 0.9, 0.0), contact.point, atol=1e-12)
