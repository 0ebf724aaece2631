"""Tests of the committed URDF as Pinocchio and PyBullet load it."""

import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin
import pytest
from hrp2_description.robot import load_robot_config

ROBOT = load_robot_config()
MODEL = pin.buildModelFromUrdf(str(ROBOT.urdf_path), pin.JointModelFreeFlyer())


def _placed(posture):
    """Return Pinocchio's data and configuration with the feet on the floor around the origin."""
    data = MODEL.createData()
    q = pin.neutral(MODEL)
    for name, angle in zip(ROBOT.joint_names, posture, strict=True):
        q[MODEL.joints[MODEL.getJointId(name)].idx_q] = angle
    pin.framesForwardKinematics(MODEL, data, q)
    soles = [data.oMf[MODEL.getFrameId(name)].translation.copy() for name in ("r_sole", "l_sole")]
    q[:3] = -np.mean(soles, axis=0)
    pin.framesForwardKinematics(MODEL, data, q)
    return data, q


def _frame(data, name):
    return data.oMf[MODEL.getFrameId(name)]


def _names(element):
    return [each.attrib["name"] for each in ET.parse(ROBOT.urdf_path).getroot().findall(element)]


def test_left_is_the_mirror_of_right():
    """Mass, CoM and inertia are those of the other side, reflected in the plane y = 0."""
    flip = np.diag([1.0, -1.0, 1.0])
    for right in ROBOT.joint_names:
        if right.startswith("R"):
            one, other = (
                MODEL.inertias[MODEL.getJointId(name)] for name in (right, "L" + right[1:]))
            assert one.mass == pytest.approx(other.mass)
            np.testing.assert_allclose(flip @ one.lever, other.lever, atol=1e-9, err_msg=right)
            np.testing.assert_allclose(
                flip @ one.inertia @ flip, other.inertia, atol=1e-9, err_msg=right)


def test_the_foot_has_the_published_mass_and_centre():
    """Ankle link and sole together are the published foot of 1.64 kg."""
    foot = MODEL.inertias[MODEL.getJointId("RLEG_JOINT5")]
    assert foot.mass == pytest.approx(1.6388, abs=1e-6)
    np.testing.assert_allclose(foot.lever, [-0.0007, -0.0047, -0.0654], atol=1e-6)


def test_thirty_moving_joints_in_the_robots_order():
    """Moving joints come first, chain by chain."""
    counts = {"RLEG": 6, "LLEG": 6, "CHEST": 2, "HEAD": 2, "RARM": 7, "LARM": 7}
    moving = [f"{chain}_JOINT{i}" for chain, n in counts.items() for i in range(n)]
    assert list(ROBOT.joint_names) == _names("joint")[:30] == moving


def test_half_sitting_waist_height_and_soles():
    """The waist is at 0.3 cos 26 + 0.3 cos 24 + 0.105 m and both soles lie flat on the floor."""
    data, q = _placed(ROBOT.half_sitting)
    assert q[2] == pytest.approx(0.648702, abs=1e-6)
    for name, y in (("r_sole", -0.095), ("l_sole", 0.095)):
        np.testing.assert_allclose(_frame(data, name).translation, [0.0, y, 0.0], atol=1e-9)
        np.testing.assert_allclose(_frame(data, name).rotation, np.eye(3), atol=1e-9)


def test_half_sitting_com():
    """The CoM has the height of the published models and lies above the middle of the feet."""
    _, q = _placed(ROBOT.half_sitting)
    com = pin.centerOfMass(MODEL, MODEL.createData(), q)
    assert 0.8077 < com[2] < 0.814
    assert abs(com[1]) < 0.002
    assert abs(com[0]) < 0.02


def test_half_sitting_inertia():
    """Rotational inertia about the CoM agrees with LAAS's and Klampt's figures to 5 %."""
    _, q = _placed(ROBOT.half_sitting)
    data = MODEL.createData()
    pin.ccrba(MODEL, data, q, np.zeros(MODEL.nv))
    np.testing.assert_allclose(np.diag(data.Ig.inertia), [8.158, 6.942, 1.729], rtol=0.05)
    assert pin.computeTotalMass(MODEL) == pytest.approx(58.0, abs=1e-6)


def test_braced_wrist_presses_its_pad_into_the_trunks():
    """The wrist's ball is 0.5 to 3 mm inside the trunk's disc, within the disc's radius."""
    data, _ = _placed(ROBOT.posture(ROBOT.braced_posture))
    brace = ROBOT.brace
    places = [_frame(data, pad.link).act(np.array(pad.place)) for pad in (brace.arm, brace.trunk)]
    offset = places[0] - places[1]
    across = float(offset @ np.array(brace.normal))
    assert -3e-3 < across - brace.arm.size < -5e-4
    assert np.linalg.norm(offset - across * np.array(brace.normal)) < 0.3 * brace.trunk.size


@pytest.fixture(scope="module")
def bullet():
    """A PyBullet world without a window that contains the robot."""
    pybullet = pytest.importorskip("pybullet")
    client = pybullet.connect(pybullet.DIRECT)
    body = pybullet.loadURDF(
        str(ROBOT.urdf_path), flags=pybullet.URDF_USE_INERTIA_FROM_FILE, physicsClientId=client
    )
    yield pybullet, client, body
    pybullet.disconnect(client)


def _pose(bullet, posture):
    pybullet, client, body = bullet
    angles = dict(zip(ROBOT.joint_names, posture, strict=True))
    links = {}
    for i in range(pybullet.getNumJoints(body, physicsClientId=client)):
        info = pybullet.getJointInfo(body, i, physicsClientId=client)
        links[info[12].decode()] = i
        pybullet.resetJointState(body, i, angles.get(info[1].decode(), 0.0), physicsClientId=client)
    pybullet.performCollisionDetection(physicsClientId=client)
    return links


def test_elbow_touches_a_wall_first(bullet):
    """In the braced posture the elbow's sphere is the body nearest to a wall on the right."""
    pybullet, client, body = bullet
    links = _pose(bullet, ROBOT.posture(ROBOT.braced_posture))
    slab = pybullet.createCollisionShape(
        pybullet.GEOM_BOX, halfExtents=[2.0, 0.1, 2.0], physicsClientId=client
    )
    wall = pybullet.createMultiBody(0.0, slab, basePosition=[0, -1.1, 0], physicsClientId=client)
    gaps = {}
    for name, i in {"base_link": -1, **links}.items():
        if pybullet.getCollisionShapeData(body, i, physicsClientId=client):
            near = pybullet.getClosestPoints(body, wall, 5.0, i, -1, physicsClientId=client)
            gaps[name] = min(point[8] for point in near)
    elbow = pybullet.getLinkState(body, links[ROBOT.contact_link], physicsClientId=client)[4]
    pybullet.removeBody(wall, physicsClientId=client)
    first = gaps.pop(ROBOT.contact_link)
    assert first == pytest.approx(elbow[1] + 1.0 - ROBOT.contact_radius, abs=2e-3)
    # The upper arm ends at the elbow; its rim is farther away than the sphere around the elbow.
    assert gaps.pop("RARM_LINK2") - first > 0.015
    assert min(gaps.values()) - first > 0.09


def test_nothing_reaches_below_the_soles(bullet):
    """In half-sitting the soles' boxes are the lowest collision shapes, 0.23 x 0.13 m."""
    robot = ET.parse(ROBOT.urdf_path).getroot()
    assert not [
        link
        for link in robot.iter("link")
        if link.attrib["name"] in ("l_ankle", "r_ankle") and link.findall("collision")
    ]
    pybullet, client, body = bullet
    lows = {}
    count = len(_pose(bullet, ROBOT.half_sitting))
    for i in range(-1, count):
        if pybullet.getCollisionShapeData(body, i, physicsClientId=client):
            link = pybullet.getJointInfo(body, i, physicsClientId=client)[12] if i >= 0 else b"base"
            lows[link.decode()] = pybullet.getAABB(body, i, physicsClientId=client)[0][2]
    others = min(value for name, value in lows.items() if not name.endswith("_sole"))
    assert others > max(lows["l_sole"], lows["r_sole"]) + 0.05
