"""Meshes of a URDF, from the folders of installed packages."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from hrp2_description.data import share_folders
from numpy.typing import NDArray

from door_impact_view.scene.urdf import UrdfScene

MOST_TRIANGLES = 150_000  # of all meshes of a page without a server: some 4 MB
FINEST_GRID = 0.001  # onto which the corners of larger meshes are moved at first [m]
_NAME = re.compile(r"package://([A-Za-z][\w-]*)/([^/\0][^\0]*)")
Mesh = tuple[NDArray[np.float32], NDArray[np.uint32]]
"""Vertices (V, 3) and triangles (F, 3)."""


def mesh_path(file: str) -> Path | None:
    """Return the path of a mesh ``package://NAME/PATH``; None if there is no such file.

    Only files within a package's own folder are read: a URDF comes from the network.

    Args:
        file: Name of the mesh in the URDF.
    """
    named = _NAME.fullmatch(file)
    if named is None or ".." in Path(named[2]).parts:
        return None
    paths = (folder / named[2] for folder in share_folders(named[1]))
    return next((path for path in paths if path.is_file()), None)


def load_meshes(scenes: Sequence[UrdfScene]) -> tuple[dict[str, Mesh], str]:
    """Read the meshes of URDFs.

    Args:
        scenes: The URDFs.

    Returns:
        The meshes by their names in the URDFs, and a sentence about those that are left out; empty
        if none is.
    """
    files = list(dict.fromkeys(
        shape.file for scene in scenes for shape in scene.shapes if shape.kind == "mesh"))
    if files and find_spec("trimesh") is None:
        return {}, (f"The {len(files)} meshes of the URDF are left out, because trimesh, which "
                    "reads them, is not installed: run 'pip install trimesh'.")
    meshes = {file: mesh for file in files if (mesh := load_mesh(file)) is not None}
    missing = [file for file in files if file not in meshes]
    if not missing:
        return meshes, ""
    return meshes, (f"{len(missing)} of {len(files)} meshes of the URDF cannot be read and are "
                    f"left out, the first is {missing[0]}.")


def fit_meshes(
    meshes: Mapping[str, Mesh], scales: Mapping[str, float], most: int = MOST_TRIANGLES
) -> tuple[dict[str, Mesh], str]:
    """Make meshes so coarse that together they have no more than a number of triangles.

    Meshes that fit are returned as they are. Of others the corners are moved onto a grid, the same
    one for all, and triangles that are then a line or there twice are left out. The grid is as fine
    as a doubling of `FINEST_GRID` can make it.

    Args:
        meshes: The meshes by name.
        scales: By how much each is enlarged when it is drawn, more than 0.
        most: Largest number of triangles.

    Returns:
        The meshes, and a sentence that says what was changed; empty if nothing was.
    """
    fitted, grid = dict(meshes), 0.5 * FINEST_GRID
    before = _triangles(fitted)
    while _triangles(fitted) > most:
        grid *= 2.0
        fitted = {name: _coarser(mesh, grid / scales[name]) for name, mesh in meshes.items()}
    if grid < FINEST_GRID:
        return fitted, ""
    return fitted, (
        f"The meshes have {before} triangles, more than {most}: their corners were moved onto a "
        f"grid of {1e3 * grid:g} mm, which leaves {_triangles(fitted)} triangles.")


def load_mesh(file: str) -> Mesh | None:
    """Read a mesh; None if it is not there, or of a format that cannot be read.

    Args:
        file: Name of the mesh in the URDF.
    """
    path = mesh_path(file)
    if path is None:
        return None
    import trimesh

    try:
        mesh: Any = trimesh.load(path, force="mesh")
        vertices = np.asarray(mesh.vertices, dtype=np.float32)
        faces = np.asarray(mesh.faces, dtype=np.uint32)
    except Exception:  # the readers of the formats raise whatever they like
        return None
    if not len(faces) or not np.isfinite(vertices).all():
        return None
    return vertices, faces


def _triangles(meshes: Mapping[str, Mesh]) -> int:
    return sum(len(faces) for _, faces in meshes.values())


def _coarser(mesh: Mesh, grid: float) -> Mesh:
    """Return a mesh whose corners lie on a grid [unit of the mesh]."""
    vertices, faces = mesh
    places, index = np.unique(np.round(vertices.astype(np.float64) / grid), axis=0,
                              return_inverse=True)
    corners = np.sort(index.reshape(-1)[faces], axis=1)
    kept = np.unique(corners[(np.diff(corners, axis=1) > 0).all(axis=1)], axis=0)
    return (grid * places).astype(np.float32), kept.astype(np.uint32)
