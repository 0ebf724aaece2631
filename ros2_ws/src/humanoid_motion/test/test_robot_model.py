"""Pinocchio wrapper: poses, masses, inertia, effective mass, kinds of legs."""

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest
from hrp2_description.errors import RobotConfigError
from humanoid_motion.robot_model import RobotModel


@pytest.fixture(scope="module")
def at_hit(robot, stance):
    """Configuration at the hit."""
    return robot.configuration(stance.posture.base, stance.posture.joints)


def test_joint_order_is_hrp2s(robot):
    """Turning one joint moves the links behind it and no other."""
    moved_by = {"RLEG_JOINT3": "r_sole", "LARM_JOINT3": "l_gripper", "HEAD_JOINT0": "gaze"}
    links = list(moved_by.values())
    before = robot.poses_in_base(robot.config.half_sitting, links)
    for joint, link in moved_by.items():
        posture = np.array(robot.config.half_sitting)
        posture[robot.config.index(joint)] += 0.2
        after = robot.poses_in_base(posture, links)
        changed = [name for name, one, two in zip(links, before, after, strict=True)
                   if not np.allclose(one, two)]
        assert changed == [link]


def test_transforms_chain_up_to_each_links_pose(robot):
    """Following the URDF's tree from base_link gives the pose of every link."""
    root = ElementTree.parse(robot.config.urdf_path).getroot()
    joints = {(joint.find("parent").attrib["link"], joint.find("child").attrib["link"])
              for joint in root.findall("joint")}
    assert set(robot.tree) == joints
    posture = np.random.default_rng(0).uniform(robot.lower, robot.upper)
    poses = {"base_link": pin.SE3.Identity()}
    for (parent, child), row in zip(robot.tree, robot.link_transforms(posture), strict=True):
        poses[child] = poses[parent] * pin.XYZQUATToSE3(row)
    assert len(poses) == 37
    for pose, own in zip(poses.values(), robot.poses_in_base(posture, poses), strict=True):
        np.testing.assert_allclose(pose.homogeneous, own, atol=1e-9)


def test_com_counts_every_link_once(robot):
    """The CoM is the weighted mean of the centres of mass of all links of the URDF."""
    posture = np.random.default_rng(1).uniform(robot.lower, robot.upper)
    total, moment = 0.0, np.zeros(3)
    for link in ElementTree.parse(robot.config.urdf_path).getroot().findall("link"):
        inertial = link.find("inertial")
        if inertial is not None:
            mass = float(inertial.find("mass").attrib["value"])
            origin = [float(each) for each in inertial.find("origin").attrib["xyz"].split()]
            (pose,) = robot.poses_in_base(posture, [link.attrib["name"]])
            total, moment = total + mass, moment + mass * (pose @ [*origin, 1.0])[:3]
    assert total == pytest.approx(robot.mass)
    com = robot.com(robot.configuration(np.zeros(3), posture))
    np.testing.assert_allclose(com, moment / total, atol=1e-9)


def test_contact_jacobian_is_the_slope_of_the_contact_position(robot, at_hit):
    """Central differences along joints agree, in the axes of odom."""
    jacobian = robot.contact_jacobian(at_hit)
    for joint in ("RARM_JOINT1", "CHEST_JOINT0", "RARM_JOINT0"):
        column = robot.q_index[robot.indices([joint])[0]]
        step = np.zeros_like(at_hit)
        step[column] = 1e-6
        slope = robot.contact_position(at_hit + step) - robot.contact_position(at_hit - step)
        np.testing.assert_allclose(
            slope / 2e-6, jacobian[:, robot.v_index[robot.indices([joint])[0]]], atol=1e-8
        )


def test_a_stiff_robot_in_the_air_shows_eq_3_s_mass_at_most(robot, at_hit, stance):
    """All joints locked and no feet: eq. (3), less what yaw and pitch take off."""
    posture = stance.posture
    planar = robot.mass * posture.i_rob / (posture.i_rob + robot.mass * posture.a_r**2)
    stiff = robot.effective_mass(at_hit, locked=robot.joint_names, feet=())
    assert stiff <= planar
    assert stiff == pytest.approx(planar, rel=0.02)


def test_each_freedom_taken_away_adds_mass(robot, at_hit):
    """Rayleigh: constraints never lower the effective mass, nor do rotors."""
    braced = robot.config.braced_joints
    upper = [name for name in robot.joint_names if "LEG" not in name]
    free = robot.effective_mass(at_hit, locked=())
    held = robot.effective_mass(at_hit, locked=braced)
    whole = robot.effective_mass(at_hit, locked=upper)
    assert free < held < whole
    assert robot.effective_mass(at_hit, locked=braced, feet=()) <= held
    assert robot.effective_mass(at_hit, locked=braced, rotors=True) > held
    rotors = robot.effective_mass(at_hit, locked=(), rotors=True)
    assert free < rotors < held


def test_inertia_about_the_com_is_a_plausible_robot_s(robot, at_hit):
    """Symmetric, positive, triangle inequality; I_rob between 6 and 9 kg m^2."""
    inertia = robot.inertia_about_com(at_hit)
    np.testing.assert_allclose(inertia, inertia.T, atol=1e-9)
    eigenvalues = np.linalg.eigvalsh(inertia)
    assert eigenvalues[0] > 0.0
    assert eigenvalues[2] < eigenvalues[0] + eigenvalues[1]
    assert 6.0 < inertia[0, 0] < 9.0


def test_hand_radius_is_read_from_the_urdf_unless_it_is_configured(robot):
    """The hand is a sphere of a few centimetres."""
    assert 0.02 < robot.hand_radius < 0.1
    assert RobotModel(replace(robot.config, hand_radius=0.07)).hand_radius == 0.07
    with pytest.raises(RobotConfigError, match="imu_link"):
        _ = RobotModel(replace(robot.config, hand_link="imu_link")).hand_radius


@pytest.mark.parametrize(
    ("joint", "tag", "changes", "message"),
    [
        ("RLEG_JOINT1", "axis", {"xyz": "0 1 0"}, "cannot move the foot in every direction"),
        ("LLEG_JOINT0", "origin", {"rpy": "0 0 0.1"}, "turn of the foot of the left leg"),
    ],
)
def test_a_leg_of_another_kind_or_a_joint_without_an_axis_is_refused(
    robot, tmp_path, joint, tag, changes, message
):
    """The closed form would place the foot wrongly."""
    tree = ElementTree.parse(robot.config.urdf_path)
    element = tree.find(f"./joint[@name='{joint}']/{tag}")
    element.attrib.update(changes)
    tree.write(tmp_path / "other.urdf")
    with pytest.raises(RobotConfigError, match=message):
        RobotModel(replace(robot.config, urdf_path=tmp_path / "other.urdf"))
