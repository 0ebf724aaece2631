"""Reflections of a robot, its motions and its measurements."""

import dataclasses
import re
import xml.etree.ElementTree as ET
from importlib import import_module

import numpy as np
import pytest
from door_impact_msgs.msg import DoorPassagePlan, HandCompliance, ImpactPlan, PlanPhase
from geometry_msgs.msg import Point, PointStamped, WrenchStamped
from hrp2_description.errors import RobotConfigError
from hrp2_description.robot import load_robot_config
from humanoid_motion import mirror
from humanoid_motion.driver_interface import TickSample
from humanoid_motion.mirror import Mirror
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.samples import ImuSample
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import Imu, JointState
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

CONFIG = load_robot_config()
MIRROR = Mirror(CONFIG)
ROBOT = RobotModel(CONFIG)
SIDED = re.compile(r"(^|_)(x|y|roll|yaw|heading|torque|impulse|offset)(_|$)")
HANDLED = {*mirror._AXIAL, *mirror._OF_JOINTS, *mirror._TORQUES, "force", "linear_acceleration"}
ALIKE = {"foot_impulse", "foot_impulse_planar", "peak_torque", "ratcheting_torque",
         "required_impulse", "torque_ratio", "times", "leaf_angle", "hand_force", "hand_radius"}
FRAMES = ("l_sole", "r_sole", "l_gripper", "r_gripper", "RARM_LINK3", "LARM_LINK3", "imu_link")


def posture(seed):
    """Base, orientation and joints of a robot that faces about -x."""
    random = np.random.default_rng(seed)
    turn = Rotation.from_euler("ZYX", [np.pi + random.normal(0.0, 0.5), *random.normal(0, 0.1, 2)])
    return (random.normal(size=3), turn.as_quat(), random.uniform(CONFIG.lower, CONFIG.upper))


def q_of(base, turn, joints):
    """Pinocchio's configuration."""
    q = ROBOT.configuration(base, joints)
    q[3:7] = turn
    return q


@pytest.mark.parametrize("seed", range(3))
def test_links_of_the_image_are_where_the_mirror_shows_their_twins(seed):
    """All of them, with their orientations."""
    base, turn, joints = posture(seed)
    here = q_of(base, turn, joints)
    there = q_of(mirror.places(base), mirror.orientations(turn), MIRROR.joints(joints))
    for name in FRAMES:
        place, turn = ROBOT.frame_pose(here, name)
        image, turned = ROBOT.frame_pose(there, MIRROR.text(name))
        np.testing.assert_allclose(image, mirror.places(place), atol=1e-9)
        np.testing.assert_allclose(
            turned, np.diag([-1, 1, 1]) @ turn @ np.diag([1, -1, 1]), atol=1e-9)
    off = ROBOT.com(there) - mirror.places(ROBOT.com(here))
    assert 2.5e-3 < np.linalg.norm(off) < 3.5e-3  # the trunk is not symmetric


def heard(message):
    """The reading of an Imu."""
    turn, rate, force = (
        message.orientation, message.angular_velocity, message.linear_acceleration)
    return ImuSample(np.array([turn.x, turn.y, turn.z, turn.w]),
                     *(np.array([each.x, each.y, each.z]) for each in (rate, force)))


@pytest.mark.parametrize("rpy", ["0 0 0", "3.1416 0 1.5708", "0 1.5708 0", "0.3 -0.5 2.0"])
def test_an_imu_tells_the_bases_tilt_and_its_image_is_what_the_images_imu_reads(tmp_path, rpy):
    """However it and the robot are turned, with a bent chest; as a sample and as a message."""
    tree = ET.parse(CONFIG.urdf_path)
    tree.getroot().find("joint[@name='imu_link_joint']/origin").attrib["rpy"] = rpy
    tree.write(tmp_path / "turned.urdf")
    robot = RobotModel(dataclasses.replace(CONFIG, urdf_path=tmp_path / "turned.urdf"))
    turned, world = Mirror(robot.config), np.array([-1.0, 1.0, 1.0])
    (base, _, joints), (rate, force) = posture(5), np.random.default_rng(6).normal(size=(2, 3))
    fallen = Rotation.from_euler("ZYX", [2.0, 0.5, 2.5])
    turn, tilt = fallen.as_quat(), np.arccos(fallen.as_matrix()[2, 2])

    def read(base, turn, joints, rate, force):
        frame = robot.frame_pose(q_of(base, turn, joints), CONFIG.imu_frame)[1]
        return ImuSample(Rotation.from_matrix(frame).as_quat(), frame.T @ rate, frame.T @ force)

    here = read(base, turn, joints, rate, force)
    assert robot.base_tilt(joints, here.rotation) == pytest.approx(tilt)
    there = read(mirror.places(base), mirror.orientations(turn), turned.joints(joints),
                 -world * rate, world * force)
    message = Imu()
    for part, row in zip(("orientation", "angular_velocity", "linear_acceleration"),
                         dataclasses.astuple(here), strict=True):
        kind = type(getattr(message, part))
        setattr(message, part, kind(**dict(zip("xyzw", row.tolist(), strict=False))))
    for image in (turned.imu_sample(here), heard(turned.message(message))):
        np.testing.assert_allclose(image.rotation, there.rotation, atol=1e-9)
        np.testing.assert_allclose(image.angular_velocity, there.angular_velocity, atol=1e-9)
        np.testing.assert_allclose(image.specific_force, there.specific_force, atol=1e-9)


def test_limits_of_twins_are_alike():
    """So the image keeps the robot's limits if its motion keeps its own."""
    ends = [CONFIG.lower, CONFIG.upper]
    np.testing.assert_allclose(np.sort(MIRROR.joints(ends), axis=0), ends, atol=1e-12)
    for values in (CONFIG.velocity_limit, CONFIG.effort_limit):
        np.testing.assert_allclose(np.abs(MIRROR.joints(values)), values)


def test_rolls_and_yaws_change_their_sign_and_limbs_their_side():
    """By names and axes in the URDF; the search reads no names."""
    axes = {joint.attrib["name"]: joint.find("axis").attrib["xyz"].split()
            for joint in ET.parse(CONFIG.urdf_path).getroot().iter("joint") if joint.find("axis")
            is not None}
    for name, sign in zip(CONFIG.joint_names, MIRROR.joints(np.ones(30)), strict=True):
        side = name[0] if name[1:4] in ("LEG", "ARM") else ""
        assert MIRROR.text(name) == {"R": "L", "L": "R"}.get(side, name[0]) + name[1:]
        assert sign == (1.0 if float(axes[name][1]) else -1.0), name


def test_reflections_are_their_own_inverse():
    """Of the measurements of a tick, whose wrenches change sides, and of headings."""
    random = np.random.default_rng(2)
    reading = ImuSample(*(random.normal(size=count) for count in (4, 3, 3)))
    rows = [random.normal(size=count) for count in (30, 30, 30, 6, 6)]
    sample = TickSample(1.0, *rows, reading, (1, 2), random.normal(size=6), None)
    image = MIRROR.sample(sample)
    np.testing.assert_array_equal(
        image.imu.angular_velocity, reading.angular_velocity * [-1, 1, -1])
    np.testing.assert_array_equal(
        image.right_wrench, sample.left_wrench * [1, -1, 1, -1, 1, -1])
    assert image.left_hand_wrench is None
    again = MIRROR.sample(image)
    for one, other in zip(dataclasses.astuple(again), dataclasses.astuple(sample), strict=True):
        np.testing.assert_equal(one, other)
    about_z = mirror.orientations([0.0, 0.0, np.sin(0.1), np.cos(0.1)])
    assert Rotation.from_quat(about_z).magnitude() == pytest.approx(float(mirror.headings(0.2)))


def test_a_text_names_twins():
    """Whole words alone."""
    text = "RARM_JOINT3 of the right arm, l_sole, /left_foot/wrench and XRARM_JOINT3"
    assert MIRROR.text(text) == (
        "LARM_JOINT3 of the left arm, r_sole, /right_foot/wrench and XRARM_JOINT3")
    assert MIRROR.text(MIRROR.text(text)) == text


def test_messages_are_those_of_the_other_side():
    """Of joints, feet and commands; each is its own image's image."""
    joints = JointState(name=["RARM_JOINT3", "LLEG_JOINT1", "door_hinge"],
                        position=[1.0, 2.0, 3.0], velocity=[4.0, 5.0, 6.0])
    image = MIRROR.message(joints)
    assert list(image.name) == ["LARM_JOINT3", "RLEG_JOINT1", "door_hinge"]
    assert list(image.position) == [1.0, -2.0, 3.0]
    command = JointTrajectory(joint_names=list(CONFIG.joint_names), points=[JointTrajectoryPoint(
        positions=np.arange(30.0).tolist(), velocities=np.ones(30).tolist())])
    there = MIRROR.message(command)
    by_name = dict(zip(there.joint_names, there.points[0].positions, strict=True))
    np.testing.assert_array_equal(
        [by_name[name] for name in CONFIG.joint_names], MIRROR.joints(np.arange(30.0)))
    foot = WrenchStamped()
    foot.header.frame_id, foot.wrench.force.y, foot.wrench.torque.x = "l_sole", 3.0, 4.0
    other = MIRROR.message(foot)
    assert (other.header.frame_id, other.wrench.force.y, other.wrench.torque.x) == (
        "r_sole", -3.0, -4.0)
    zmp = PointStamped(point=Point(x=1.0, y=2.0))
    assert MIRROR.message(zmp).point == Point(x=-1.0, y=2.0)
    for message in (joints, command, foot, zmp):
        assert MIRROR.message(message) != message
        assert MIRROR.message(MIRROR.message(message)) == message


def fields_of(kind):
    """Names and kinds of all fields of a message, and of the messages in it but for points."""
    for name, field in kind.get_fields_and_field_types().items():
        package, _, part = field.removeprefix("sequence<").rstrip(">").partition("/")
        if part and part not in ("Point", "Quaternion", "Vector3"):
            yield from fields_of(getattr(import_module(f"{package}.msg"), part))
        else:
            yield name, field


@pytest.mark.parametrize("kind", [
    DoorPassagePlan, HandCompliance, ImpactPlan, Imu, JointState, JointTrajectory, PointStamped,
    WrenchStamped])
def test_the_mirror_knows_each_vector_list_and_lateral_number_of_a_message(kind):
    """By its name; what is added to a message must be reflected, or is alike on both sides."""
    for name, field in fields_of(kind):
        if field in ("geometry_msgs/Vector3", "sequence<double>") or (
                field == "double" and SIDED.search(name)):
            assert name in HANDLED | ALIKE


def test_feet_of_a_plan_change_sides_and_face_the_other_way():
    """Its points are at -x, and its identifier stays."""
    plan = ImpactPlan(plan_id="left", brace_joint="RARM_JOINT1", brace_impulse=2.0)
    plan.left_foot.position.x, plan.right_foot.position.x = 1.0, 2.0
    plan.phases = [PlanPhase(name="back", com=[Point(x=1.0)])]
    image = MIRROR.message(plan)
    assert (image.plan_id, image.brace_joint, image.brace_impulse) == ("left", "LARM_JOINT1", -2.0)
    assert (image.left_foot.position.x, image.right_foot.position.x) == (-2.0, -1.0)
    assert image.left_foot.orientation.z == 1.0
    assert (image.phases[0].name, image.phases[0].com[0].x) == ("back", -1.0)
    assert MIRROR.message(image) == plan


def test_the_simulated_robot_leans_on_its_left_arm():
    """Its pads touch where those of the image do."""
    left = MIRROR.left_armed(CONFIG)
    assert left.contact_link == "LARM_LINK3"
    assert left.brace.arm.link == "LARM_LINK4"
    assert left.brace.trunk.place == (0.030, 0.179, 0.233)
    assert left.brace.normal == (0, 1, 0)
    np.testing.assert_allclose(left.posture(left.braced_posture),
                               MIRROR.joints(CONFIG.posture(CONFIG.braced_posture)))
    with pytest.raises(RobotConfigError, match=r"contact_link has no mirror image .*'torso'"):
        MIRROR.left_armed(dataclasses.replace(CONFIG, contact_link="torso"))


@pytest.mark.parametrize(("joint", "xyz"), [
    ("LARM_JOINT3", "0 0.005 -0.25"), ("CHEST_JOINT0", "0.032 0.01 0.3507")])
def test_a_robot_without_an_image_is_refused(tmp_path, joint, xyz):
    """Arms that differ, a trunk beside the middle, and an IMU on a limb."""
    tree = ET.parse(CONFIG.urdf_path)
    tree.getroot().find(f"joint[@name='{joint}']/origin").attrib["xyz"] = xyz
    path = tmp_path / "other.urdf"
    tree.write(path)
    for change in {"urdf_path": path}, {"imu_frame": "l_sole"}:
        with pytest.raises(RobotConfigError, match="no mirror image"):
            Mirror(dataclasses.replace(CONFIG, **change))
