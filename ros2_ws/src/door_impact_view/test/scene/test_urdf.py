"""Tests of what is read from a URDF, and of the poses of its links."""

import contextlib
import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin
import pytest
from door_impact_view.errors import UrdfError, ViewError
from door_impact_view.scene.poses import link_poses, rotate
from door_impact_view.scene.urdf import GREY, read_urdf
from hrp2_description.data import data_path
from hypothesis import given
from hypothesis import strategies as st

HRP2 = data_path("urdf/hrp2.urdf").read_text(encoding="utf-8")
KINDS = ("revolute", "continuous", "prismatic", "fixed")
numbers = st.floats(-2.0, 2.0)
triples = st.tuples(numbers, numbers, numbers)
axes = triples.filter(lambda axis: np.linalg.norm(axis) > 0.1)


def text(values) -> str:
    """Numbers as URDF writes them."""
    return " ".join(repr(float(value)) for value in values)


@st.composite
def trees(draw):
    """A URDF with up to nine links, its joints in any order, and a position of each joint."""
    count = draw(st.integers(1, 9))
    robot = ET.Element("robot", name="random")
    for index in range(count):
        link = ET.SubElement(robot, "link", name=f"L{index}")
        inertial = ET.SubElement(link, "inertial")  # Pinocchio's: no link without mass is merged
        ET.SubElement(inertial, "mass", value="1")
        ET.SubElement(inertial, "inertia", ixx="1", ixy="0", ixz="0", iyy="1", iyz="0", izz="1")
    positions = {}
    for index in draw(st.permutations(range(1, count))):
        kind = draw(st.sampled_from(KINDS))
        joint = ET.SubElement(robot, "joint", name=f"J{index}", type=kind)
        ET.SubElement(joint, "parent", link=f"L{draw(st.integers(0, index - 1))}")
        ET.SubElement(joint, "child", link=f"L{index}")
        ET.SubElement(joint, "origin", xyz=text(draw(triples)), rpy=text(draw(triples)))
        axis = np.array(draw(axes))
        ET.SubElement(joint, "axis", xyz=text(axis / np.linalg.norm(axis)))
        ET.SubElement(joint, "limit", lower="-9", upper="9", effort="1", velocity="1")
        positions[f"J{index}"] = draw(numbers) if kind != "fixed" else 0.0
    return ET.tostring(robot, encoding="unicode"), positions


def pinocchio_poses(urdf: str, positions):
    """Place and rotation matrix of every link in the root link, by Pinocchio."""
    model = pin.buildModelFromXML(urdf)
    data, q = model.createData(), pin.neutral(model)
    for name, position in positions.items():
        if not model.existJointName(name):
            continue
        joint = model.joints[model.getJointId(name)]
        if joint.nq == 2:  # a continuous joint
            q[joint.idx_q : joint.idx_q + 2] = np.cos(position), np.sin(position)
        else:
            q[joint.idx_q] = position
    pin.framesForwardKinematics(model, data, q)
    return {frame.name: (data.oMf[index].translation, data.oMf[index].rotation)
            for index, frame in enumerate(model.frames) if frame.type == pin.FrameType.BODY}


def assert_same_poses(urdf: str, positions) -> None:
    """Every link is where Pinocchio has it."""
    expected = pinocchio_poses(urdf, positions)
    found = link_poses(read_urdf(urdf), positions)
    assert set(found) == set(expected)
    for link, (place, turn) in found.items():
        np.testing.assert_allclose(place, expected[link][0], atol=1e-9)
        columns = rotate(turn, np.eye(3))
        np.testing.assert_allclose(columns.T, expected[link][1], atol=1e-9)


@given(trees())
def test_links_of_any_tree_are_where_pinocchio_has_them(tree):
    """The poses of every link equal Pinocchio's forward kinematics, whatever the joints are."""
    assert_same_poses(*tree)


@given(st.lists(st.floats(-1.5, 1.5), min_size=30, max_size=30))
def test_hrp2_is_where_pinocchio_has_it(angles):
    """The same for HRP-2 in any posture."""
    turning = [joint.name for joint in read_urdf(HRP2).joints if joint.kind == "revolute"]
    assert_same_poses(HRP2, dict(zip(turning, angles, strict=True)))


ONE = '<robot name="r"><link name="a"><visual>{}</visual></link></robot>'


def shape_of(visual: str):
    """The only shape of a URDF with one link."""
    (shape,) = read_urdf(ONE.format(visual)).shapes
    return shape


def test_shapes_of_every_kind():
    """Sizes, place, colour and file are as the URDF has them; without a colour a shape is grey."""
    box = shape_of('<origin xyz="1 2 3"/><geometry><box size="4 5 6"/></geometry>')
    assert (box.kind, box.size, box.place.tolist()) == ("box", (4, 5, 6), [1, 2, 3])
    assert box.color == GREY
    cylinder = shape_of('<geometry><cylinder radius="1" length="2"/></geometry>'
                        '<material name="m"><color rgba="1 0 2 0.5"/></material>')
    assert (cylinder.kind, cylinder.size, cylinder.color) == ("cylinder", (1, 2), (1, 0, 1, 0.5))
    mesh = shape_of('<geometry><mesh filename="package://p/a.stl" scale="1 -1 1"/></geometry>')
    assert (mesh.kind, mesh.size, mesh.file) == ("mesh", (1, -1, 1), "package://p/a.stl")


LINKS = '<link name="a"/><link name="b"/><link name="c"/>'


def joint(name: str, parent: str, child: str, inside: str = "") -> str:
    """A revolute joint."""
    return (f'<joint name="{name}" type="revolute"><parent link="{parent}"/>'
            f'<child link="{child}"/>{inside}</joint>')


@pytest.mark.parametrize(("inside", "problem"), [
    (LINKS, "no joint connects the links a and b"),
    (LINKS + joint("j", "a", "d"), "joint j names the link d, which does not exist"),
    (LINKS + joint("j", "b", "c") + joint("k", "c", "b"), "the joints of link b form a cycle"),
    (LINKS + joint("j", "a", "b", '<origin rpy="0 nan 0"/>'), "3 finite numbers"),
])
def test_what_is_no_tree_is_refused_in_a_sentence(inside, problem):
    """The message names the link or joint, in one line."""
    with pytest.raises(UrdfError, match=problem) as refused:
        read_urdf(f'<robot name="r">{inside}</robot>')
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("text", ["no XML", "<sdf/>"])
def test_no_urdf_is_refused(text):
    """A text that is no URDF raises an error of this package."""
    with pytest.raises(ViewError, match="the URDF cannot be drawn"):
        read_urdf(text)


@given(st.text(max_size=20), st.integers(0, len(HRP2)))
def test_damaged_text_never_fails_otherwise(inserted, place):
    """A URDF with something inserted is read, or raises an error of this package."""
    with contextlib.suppress(ViewError):
        read_urdf(HRP2[:place] + inserted + HRP2[place:])
