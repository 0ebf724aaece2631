"""Tests of meshes: which are read, and how they are made to fit into a page."""

import struct
from pathlib import Path

import pytest
from door_impact_view.scene import meshes
from door_impact_view.scene.urdf import read_urdf


def triangle() -> bytes:
    """A binary STL of one triangle."""
    corners = (0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0)
    return bytes(80) + struct.pack("<I", 1) + struct.pack("<12fH", *corners, 0)


@pytest.fixture
def package(tmp_path, monkeypatch) -> Path:
    """The folder of a package arm, with a mesh in it and a file beside it."""
    folder = tmp_path / "arm"
    (folder / "meshes").mkdir(parents=True)
    (folder / "meshes" / "hand.stl").write_bytes(triangle())
    (folder / "meshes" / "bad.stl").write_bytes(b"solid nonsense")
    (tmp_path / "secret.stl").write_bytes(triangle())
    monkeypatch.setattr(meshes, "share_folders", lambda name: [folder] if name == "arm" else [])
    return folder


def test_a_mesh_of_a_package_is_read(package):
    """Its vertices and triangles."""
    vertices, faces = meshes.load_mesh("package://arm/meshes/hand.stl")
    assert (len(vertices), len(faces)) == (3, 1)


@pytest.mark.parametrize("file", [
    "package://arm/meshes/bad.stl", "package://arm/../secret.stl", "file:///etc/passwd"])
def test_what_is_no_mesh_of_a_package_is_left_out(package, file):
    """Damaged, absent, or outside the package's folder: None, without an error."""
    assert meshes.load_mesh(file) is None


ROBOT = ('<robot name="r"><link name="a">' + "".join(
    f'<visual><geometry><mesh filename="package://arm/meshes/{name}.stl"/></geometry></visual>'
    for name in ("hand", "bad", "hand", "none")) + "</link></robot>")


def test_what_is_left_out_is_said(package):
    """How many, and the first one by its name; a mesh that is used twice is read once."""
    found, sentence = meshes.load_meshes([read_urdf(ROBOT), read_urdf(ROBOT)])
    assert list(found) == ["package://arm/meshes/hand.stl"]
    assert "2 of 3 meshes" in sentence
    assert "package://arm/meshes/bad.stl" in sentence
