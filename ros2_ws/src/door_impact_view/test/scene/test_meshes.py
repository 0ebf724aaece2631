"""Tests of meshes: which are read, and how they are made to fit into a page."""

import struct
from pathlib import Path

import numpy as np
import pytest
from door_impact_view.scene import meshes
from door_impact_view.scene.urdf import read_urdf
from hypothesis import given
from hypothesis import strategies as st


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
    "package://arm/meshes/none.stl", "package://arm/meshes/bad.stl", "package://leg/hand.stl",
    "package://arm/../secret.stl", "package://arm//etc/passwd", "package://../secret.stl",
    "package://arm", "file:///etc/passwd", "meshes/hand.stl", ""])
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


def test_without_a_reader_of_meshes_the_rest_is_shown(package, monkeypatch):
    """trimesh comes with viser, which a replay does not need."""
    monkeypatch.setattr(meshes, "find_spec", lambda _: None)
    found, sentence = meshes.load_meshes([read_urdf(ROBOT)])
    assert found == {}
    assert "pip install trimesh" in sentence
    assert meshes.load_meshes([]) == ({}, "")


def sphere(count: int, radius: float = 0.2) -> meshes.Mesh:
    """A sphere of some `count` triangles."""
    import trimesh

    made = trimesh.creation.uv_sphere(radius, count=[max(3, int((count / 4) ** 0.5)),
                                                     max(4, int(count ** 0.5))])
    return made.vertices.astype(np.float32), made.faces.astype(np.uint32)


def test_meshes_that_fit_stay_as_they_are():
    """Also when they fill the page to the last triangle."""
    mesh = sphere(500)
    fitted, sentence = meshes.fit_meshes({"a": mesh}, {"a": 1.0}, most=len(mesh[1]))
    assert fitted["a"] is mesh
    assert sentence == ""


@given(st.integers(20, 3000), st.integers(20, 3000), st.integers(0, 1000),
       st.sampled_from([0.001, 1.0, 30.0]))
def test_large_meshes_fit_and_keep_their_places(first, second, most, scale):
    """Never more triangles than allowed; no corner moves by more than the grid that is named."""
    whole = {"a": sphere(first), "b": sphere(second, 0.2 / scale)}
    scales = {"a": 1.0, "b": scale}
    fitted, sentence = meshes.fit_meshes(whole, scales, most)
    assert sum(len(faces) for _, faces in fitted.values()) <= most or not sentence
    if not sentence:
        return
    grid = 1e-3 * float(sentence.partition("grid of ")[2].partition(" mm")[0])
    for name, (vertices, faces) in fitted.items():
        if not len(faces):
            continue
        assert faces.max() < len(vertices)
        assert (np.diff(np.sort(faces, axis=1), axis=1) > 0).all()  # no triangle is a line
        used = scales[name] * vertices[faces].reshape(-1, 3).astype(float)
        before = scales[name] * whole[name][0].astype(float)
        distance = np.abs(used[:, None] - before[None]).max(axis=2).min(axis=1)
        assert distance.max() <= 0.5001 * grid + 1e-6
