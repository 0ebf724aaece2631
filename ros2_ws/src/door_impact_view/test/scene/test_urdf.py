"""Tests of what is read from a URDF, and of the poses of its links."""

import struct

import numpy as np
import pinocchio as pin
import pytest
from door_impact_view.errors import UrdfError
from door_impact_view.scene.poses import link_poses
from door_impact_view.scene.urdf import read_urdf
from hrp2_description import data
from hrp2_description.data import data_path, package_file
from hypothesis import given
from hypothesis import strategies as st

HRP2 = data_path("urdf/hrp2.urdf").read_text(encoding="utf-8")


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


ARM = """<robot name="arm"><link name="L0">{mass}</link><link name="L1">{mass}</link>
<link name="L2">{mass}</link><joint name="slide" type="prismatic"><parent link="L1"/>
<child link="L2"/><origin xyz="1 2 3" rpy="0.1 0.2 0.3"/><axis xyz="{axis}"/>
<limit lower="-9" upper="9" effort="1" velocity="1"/></joint><joint name="turn" type="continuous">
<parent link="L0"/><child link="L1"/><axis xyz="0 2 0"/></joint></robot>"""
MASS = ('<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
        "</inertial>")


def test_an_axis_of_any_length_is_a_direction():
    """A slider's way is its position, not that times the axis' length; order does not matter."""
    unit = ARM.format(mass=MASS, axis="0.6 0 0.8")
    expected = pinocchio_poses(unit.replace("0 2 0", "0 1 0"), {"turn": 0.4, "slide": 0.7})
    found = link_poses(read_urdf(ARM.format(mass=MASS, axis="3 0 4")), {"turn": 0.4, "slide": 0.7})
    for link, (place, turn) in found.items():
        np.testing.assert_allclose(place, expected[link][0], atol=1e-9)
        np.testing.assert_allclose(turn, expected[link][1], atol=1e-9)


@given(st.lists(st.floats(-1.5, 1.5), min_size=30, max_size=30))
def test_hrp2_is_where_pinocchio_has_it(angles):
    """The pose of every link equals Pinocchio's forward kinematics, in any posture."""
    scene = read_urdf(HRP2)
    turning = [joint.name for joint in scene.joints if joint.kind == "revolute"]
    positions = dict(zip(turning, angles, strict=True))
    expected, found = pinocchio_poses(HRP2, positions), link_poses(scene, positions)
    assert set(found) == set(expected)
    for link, (place, turn) in found.items():
        np.testing.assert_allclose(place, expected[link][0], atol=1e-9)
        np.testing.assert_allclose(turn, expected[link][1], atol=1e-9)


ONE = '<robot name="r"><link name="a"><visual>{}</visual></link></robot>'
HAND = '<geometry><mesh filename="package://arm/meshes/{}.stl" scale="1 -2 1"/></geometry>'


def shape_of(visual: str):
    """The only shape of a URDF with one link."""
    (shape,) = read_urdf(ONE.format(visual)).shapes
    return shape


def test_shapes_are_in_the_links_frame():
    """Place, extent and colour are as the URDF has them."""
    box = shape_of('<origin xyz="1 2 3" rpy="0 0 1.5707963267948966"/>'
                   '<geometry><box size="4 5 6"/></geometry>'
                   '<material name="m"><color rgba="1 0 0 0.5"/></material>')
    np.testing.assert_allclose(box.place, [1, 2, 3])
    np.testing.assert_allclose(box.mesh.extents, [5, 4, 6])
    assert box.color == (255, 0, 0, 127)
    cylinder = shape_of('<geometry><cylinder radius="1" length="4"/></geometry>')
    np.testing.assert_allclose(cylinder.mesh.extents, [2, 2, 4], atol=0.02)


@pytest.fixture
def package(tmp_path, monkeypatch):
    """The folder of a package arm with the mesh of one triangle, and a mesh outside it."""
    folder = tmp_path / "arm"
    (folder / "meshes").mkdir(parents=True)
    corners = (0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0)
    triangle = bytes(80) + struct.pack("<I", 1) + struct.pack("<12fH", *corners, 0)
    (folder / "meshes" / "hand.stl").write_bytes(triangle)
    (tmp_path / "secret.stl").write_bytes(triangle)
    monkeypatch.setattr(data, "share_folders",
                        lambda name: [folder] if name == "arm" else [])
    read_urdf.cache_clear()
    return folder


def test_a_mesh_of_a_package_is_scaled_and_one_that_is_not_there_is_named(package, capsys):
    """Its corners are where the URDF's scale puts them; a negative one mirrors."""
    for slashes in ("//", "///"):  # Talos' URDF has three
        mesh = shape_of(HAND.format("hand").replace("//", slashes, 1)).mesh
        np.testing.assert_allclose(mesh.bounds, [[0, -2, 0], [1, 0, 0]], atol=1e-12)
    scene = read_urdf(ONE.format(HAND.format("none")))
    assert not scene.shapes
    assert "package://arm/meshes/none.stl" in scene.note
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("file", ["package://arm/../secret.stl", "file:///etc/passwd", "hand.stl",
                                  "/a/share/arm/../secret.stl", "/etc/passwd"])
def test_only_files_of_packages_are_read(package, file):
    """A URDF comes from the network, or has another machine's paths: no other folder is read."""
    assert package_file(file) is None
    assert package_file("/a/share/arm/meshes/hand.stl") == package / "meshes" / "hand.stl"


LINKS = '<link name="a"/><link name="b"/>'
JOINT = ('<joint name="{}" type="revolute"><parent link="{}"/><child link="{}"/>{}</joint>')


@pytest.mark.parametrize("text", [
    "no XML", '<robot name="r"/>', ONE.format('<geometry><box size="1 2"/></geometry>'),
    *(f'<robot name="r">{LINKS}{joints}</robot>' for joints in (
        JOINT.format("j", "a", "b", "") + JOINT.format("k", "b", "a", ""),  # a cycle
        JOINT.format("j", "a", "b", '<origin rpy="0 nan 0"/>'),
        JOINT.format("j", "a", "b", '<axis xyz="0 0 0"/>')))])
def test_what_cannot_be_drawn_is_refused_in_one_line(text):
    """Whatever yourdfpy makes of it, the error is this package's."""
    with pytest.raises(UrdfError, match=r"the URDF cannot be drawn: .") as refused:
        read_urdf(text)
    assert "\n" not in str(refused.value)
