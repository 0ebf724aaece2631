"""Talos, a second robot, on the same door with the same code and its own robot.yaml."""

import json
import math
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hrp2_description.data import share_folders
from hrp2_description.robot import SIDES, load_robot_config
from humanoid_motion.knots import TOLERANCE
from humanoid_motion.leg_ik import leg_ik
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.zmp import edge_margin
from hypothesis import given
from hypothesis import strategies as st
from impact_planner.hit.leaf import LeafFrame
from impact_planner.hit.stance import initial_feet, sole_edges
from impact_planner.motion.cam_curve import CamRunUp
from impact_planner.plan import plan_impact
from impact_planner.task.request import PlanRequest
from impact_planner.task.settings import PlannerSettings
from impact_planner.tools import plan_cli

YAML = Path(__file__).with_name("talos.yaml")
TARGET = math.radians(25.0)
pytestmark = pytest.mark.skipif(
    not any(folder.is_dir() for folder in share_folders("example-robot-data")),
    reason="example-robot-data is not installed",
)


@pytest.fixture(scope="module")
def talos():
    """The model of Talos with fixed fingers and head."""
    return RobotModel(load_robot_config(YAML))


@pytest.fixture(scope="module")
def talos_plan(talos, known):
    """The plan that opens the paper's door to 25 deg at the end of Talos' nominal step."""
    return plan_impact(PlanRequest(TARGET), known, talos)


def along(plan):
    """Phases with positions, speeds and accelerations of the joints at 80 times."""
    for phase in plan.phases:
        yield phase, phase.knots.at(np.linspace(0.0, phase.knots.time[-1], 80))


def test_fingers_and_head_are_fixed_and_weigh(talos):
    """28 of 44 joints move, and the mass is the URDF's."""
    assert len(talos.joint_names) == talos.model.nv - 6 == 28
    assert talos.mass == pytest.approx(talos.config.mass) == pytest.approx(93.34, abs=0.01)


@pytest.mark.parametrize("side", SIDES)
@given(
    angles=st.tuples(
        st.floats(-0.3, 0.3), st.floats(-0.5, 0.5), st.floats(-1.8, 0.6), st.floats(0.02, 2.4),
        st.floats(-1.2, 0.6), st.floats(-0.5, 0.5),
    )
)  # fmt: skip
def test_its_legs_have_the_closed_form(talos, side, angles):
    """The forward kinematics of the closed-form solution is the requested pose."""

    def pose(leg):
        joints = np.zeros(len(talos.joint_names))
        joints[talos.leg_columns[side]] = leg
        q = talos.configuration(np.zeros(3), joints)
        sole, rotation = talos.frame_pose(q, talos.feet[side].frame)
        return sole - rotation @ talos.feet[side].sole, rotation

    ankle, rotation = pose(angles)
    again, turned = pose(leg_ik(talos.legs[side], ankle, rotation)[0])
    np.testing.assert_allclose(again, ankle, atol=1e-9)
    np.testing.assert_allclose(turned, rotation, atol=1e-9)


def test_no_nearer_start_of_the_run_up_has_the_same_margin(talos, talos_plan):
    """Many starts have the largest margin, since the end of the run-up decides it."""
    chosen, edges = talos_plan.hit.run_up, sole_edges(talos, talos_plan.hit.stance.feet)

    def margin(y_start):
        law = CamRunUp(speed=chosen.law.speed, distance=y_start - chosen.y_hit)
        course = law.at(np.linspace(0.0, law.duration, 200))
        return edge_margin(chosen.table.zmp(y_start - course.s, -course.v, -course.a), edges)

    largest = margin(chosen.y_start)
    assert margin(chosen.y_start - 0.03) == pytest.approx(largest, abs=1e-7)
    assert margin(chosen.y_start + 0.002) < largest - 1e-4


def test_the_papers_door_is_planned_for(talos, talos_plan):
    """Eqs. (2) and (5) and restitution hold, and m_re is between eq. (3) and the whole mass."""
    plan = talos_plan
    assert ["misses the door" in warning for warning in plan.warnings] == [True]
    assert not plan.stands_if_missed
    assert plan.effective_mass_planar < plan.effective_mass < talos.mass
    assert plan.required_impulse == pytest.approx(
        plan.effective_mass * (plan.v_rb - plan.v_rb_post)
    )
    assert plan.omega_door * plan.l_b - plan.v_rb_post == pytest.approx(
        plan.apparent_restitution * plan.v_rb)
    assert plan.joint_loads == ()
    assert plan.b_r == pytest.approx(plan.b_r_percussion, abs=1e-5)
    assert plan.hit.stance.step == pytest.approx(talos.config.step.nominal, abs=1e-4)


def test_on_a_smooth_leaf_its_effective_mass_is_eq_3_s(known, talos):
    """Without rubber and friction, only yaw separates the mass from eq. (3)."""
    plan = plan_impact(PlanRequest(TARGET), known, talos, PlannerSettings(leaf_friction=0.0))
    assert plan.effective_mass == pytest.approx(plan.effective_mass_planar, rel=5e-3)


def test_eq_2_the_door_s_momentum_is_the_robot_s_loss(known, talos, talos_plan):
    """I_A w' + braking = l_B m_re (v_rB - v'_rB), and the legs continue at v'_rB."""
    plan = talos_plan
    gained = known.door.i_a * plan.omega_door + plan.braking
    assert gained == pytest.approx(plan.l_b * plan.required_impulse)
    lost = plan.effective_mass * (plan.v_rb - plan.v_rb_post)
    assert lost == pytest.approx(plan.required_impulse)
    assert plan.v_com_post / plan.v_com == pytest.approx(plan.v_rb_post / plan.v_rb)


def test_a_heavier_robot_hits_more_slowly(plan, talos_plan):
    """For the same door and angle, Talos needs a smaller v_rB than HRP-2."""
    assert talos_plan.omega_door == plan.omega_door
    assert talos_plan.effective_mass > plan.effective_mass
    assert talos_plan.v_rb < plan.v_rb


def test_com_and_zmp_stay_inside_the_soles(talos, talos_plan):
    """The ZMP keeps 15 mm in every phase, and the CoM at rest is between the soles' edges."""
    for phase in talos_plan.phases:
        assert phase.margin > 0.015, phase.name
    final = talos_plan.phase("hold").com_samples[-1]
    corners = [talos.feet[s].corners(getattr(talos_plan, f"{s}_foot")) for s in SIDES]
    corners = np.vstack(corners)
    assert np.all(corners.min(axis=0) < final[:2])
    assert np.all(final[:2] < corners.max(axis=0))


def test_the_splines_keep_the_limits_of_the_joints(talos, talos_plan):
    """The splines keep the URDF's limits of position, speed and torque."""
    for phase, (position, velocity, _) in along(talos_plan):
        assert np.all(position >= talos.lower - TOLERANCE), phase.name
        assert np.all(position <= talos.upper + TOLERANCE), phase.name
        assert np.all(np.abs(velocity) <= talos.speed_limit * 1.001), phase.name
        assert phase.torque_ratio < 1.0


def test_feet_do_not_move_but_for_the_step(talos, talos_plan):
    """Except during the step, both soles are level, parallel and in their place."""
    start = initial_feet(talos)
    before = start["right"] - start["left"]
    placed = talos_plan.right_foot - talos_plan.left_foot
    for phase, (position, _, _) in along(talos_plan):
        if phase.name == "step":
            continue
        expected = before if phase.name in ("prepare", "shift") else placed
        for joints in position:
            q = talos.configuration(np.zeros(3), joints)
            left, right = (talos.frame_pose(q, talos.feet[side].frame) for side in SIDES)
            np.testing.assert_allclose(right[0] - left[0], expected, atol=2e-4)
            for _, rotation in (left, right):
                assert np.linalg.norm(pin.log3(rotation)) < 1e-3


def test_the_hand_holds_the_leaf_at_the_target(talos, talos_plan):
    """The hand touches the face, and elbow and wrist are clear of it."""
    q = talos.configuration(np.zeros(3), talos_plan.phase("hold").knots.position[-1])
    shift = talos_plan.left_foot - talos.frame_position(q, talos.feet["left"].frame)
    leaf = LeafFrame(talos_plan.hit.placement.hinge, TARGET)
    config = talos.config
    hand = talos.frame_position(q, config.hand_link) + shift
    assert leaf.gap(hand) == pytest.approx(talos.hand_radius(), abs=1e-3)
    lowest, highest = config.arm.heights
    assert lowest - 1e-6 <= hand[2] <= highest + 1e-6
    for link in (config.contact_link, config.arm.wrist_link):
        gap = leaf.gap(talos.frame_position(q, link) + shift)
        assert gap > config.contact_radius + 0.01, link


def test_the_command_takes_its_robot_yaml(capsys, talos_plan):
    """`plan --robot` places the door at the end of this robot's step."""
    assert plan_cli.main(["--angle-deg", "25", "--robot", str(YAML), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["plan_id"] == talos_plan.plan_id
    assert found["door_distance"] == pytest.approx(talos_plan.hit.placement.door_distance)
