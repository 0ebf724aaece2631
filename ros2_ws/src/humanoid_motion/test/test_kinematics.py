"""Link poses from joint angles."""

import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin
import pytest
from hrp2_description.robot import load_robot_config
from humanoid_motion.kinematics import RobotKinematics

ROBOT = load_robot_config()


def test_joint_order_is_hrp2s():
    """Turning one joint moves the links behind it and no other."""
    kinematics = RobotKinematics(ROBOT)
    moved_by = {"RLEG_JOINT3": "r_sole", "LARM_JOINT3": "l_gripper", "HEAD_JOINT0": "gaze"}
    kinematics.set_joints(ROBOT.half_sitting)
    before = {link: kinematics.pose(link) for link in moved_by.values()}
    for joint, link in moved_by.items():
        posture = np.array(ROBOT.half_sitting)
        posture[ROBOT.index(joint)] += 0.2
        kinematics.set_joints(posture)
        changed = {
            name for name, pose in before.items() if not np.allclose(pose, kinematics.pose(name))
        }
        assert changed == {link}


def test_transforms_chain_up_to_each_links_pose():
    """Following the tree from base_link gives the pose of every link."""
    kinematics = RobotKinematics(ROBOT)
    rng = np.random.default_rng(0)
    kinematics.set_joints(rng.uniform(ROBOT.lower, ROBOT.upper))
    poses = {"base_link": pin.SE3.Identity()}
    for (parent, child), row in zip(kinematics.tree, kinematics.link_transforms(), strict=True):
        poses[child] = poses[parent] * pin.XYZQUATToSE3(row)
    assert len(poses) == 37
    for link, pose in poses.items():
        np.testing.assert_allclose(pose.homogeneous, kinematics.pose(link), atol=1e-9)


def test_com_counts_every_link_once():
    """The CoM is the weighted mean of the centres of mass of all links of the URDF."""
    kinematics = RobotKinematics(ROBOT)
    kinematics.set_joints(np.random.default_rng(1).uniform(ROBOT.lower, ROBOT.upper))
    total, moment = 0.0, np.zeros(3)
    for link in ET.parse(ROBOT.urdf_path).getroot().findall("link"):
        inertial = link.find("inertial")
        if inertial is None:
            continue
        mass = float(inertial.find("mass").attrib["value"])
        origin = inertial.find("origin").attrib["xyz"].split()
        place = kinematics.pose(link.attrib["name"]) @ [*map(float, origin), 1.0]
        total, moment = total + mass, moment + mass * place[:3]
    assert total == pytest.approx(ROBOT.mass)
    np.testing.assert_allclose(kinematics.com(), moment / total, atol=1e-9)
