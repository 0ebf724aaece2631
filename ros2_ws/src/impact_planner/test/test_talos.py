"""Talos, a second robot, on the same door with the same code and its own robot.yaml."""

import math

import numpy as np
import pytest
from hrp2_description.data import share_folders
from hrp2_description.robot import load_robot_config
from humanoid_motion.leaf import LeafFrame
from humanoid_motion.robot_model import RobotModel
from impact_planner.motion.missed import needed_reserve
from impact_planner.plan import plan_impact
from impact_planner.task.request import PlanRequest

TARGET = math.radians(25.0)
pytestmark = pytest.mark.skipif(
    not any(folder.is_dir() for folder in share_folders("example-robot-data")),
    reason="example-robot-data is not installed",
)


@pytest.fixture(scope="module")
def talos():
    """The model of Talos with fixed fingers and head."""
    return RobotModel(load_robot_config("talos"))


@pytest.fixture(scope="module")
def talos_plan(talos, known):
    """The plan that opens the paper's door to 25 deg at the end of Talos' nominal step."""
    return plan_impact(PlanRequest(TARGET), known, talos)


def test_fingers_and_head_are_fixed_and_weigh(talos):
    assert len(talos.joint_names) == talos.model.nv - 6 == 28  # of 44 in the URDF
    assert talos.mass == pytest.approx(talos.config.mass) == pytest.approx(93.34, abs=0.01)


def test_the_papers_door_is_planned_for(talos, talos_plan):
    """Eqs. (2) and (5) and restitution hold, and m_re is above eq. (3).

    It may exceed the mass by some 5 %: the servos of the legs push on during the contact.
    """
    plan = talos_plan
    assert plan.warnings == ()
    assert plan.missed_margin > needed_reserve(talos.config)
    assert plan.effective_mass_planar < plan.effective_mass < 1.1 * talos.mass
    assert plan.required_impulse == pytest.approx(
        plan.effective_mass * (plan.v_rb - plan.v_rb_post)
    )
    assert plan.omega_door * plan.l_b - plan.v_rb_post == pytest.approx(
        plan.apparent_restitution * plan.v_rb)
    assert plan.b_r == pytest.approx(plan.b_r_percussion, abs=1e-5)
    assert plan.hit.stance.step == pytest.approx(talos.config.step.nominal, abs=1e-4)


def test_the_hand_holds_the_leaf_at_the_target(talos, talos_plan):
    """The hand touches the face, and elbow and wrist are clear of it."""
    q = talos.configuration(np.zeros(3), talos_plan.phase("hold").knots.position[-1])
    shift = talos_plan.left_foot - talos.frame_position(q, talos.feet["left"].frame)
    leaf = LeafFrame(talos_plan.hit.placement.hinge, TARGET)
    config = talos.config
    hand = talos.frame_position(q, config.hand_link) + shift
    assert leaf.gap(hand) == pytest.approx(talos.hand_radius, abs=1e-3)
    lowest, highest = config.arm.heights
    assert lowest - 1e-6 <= hand[2] <= highest + 1e-6
    for link in (config.contact_link, config.arm.wrist_link):
        gap = leaf.gap(talos.frame_position(q, link) + shift)
        assert gap > config.contact_radius + 0.01, link
