"""Meshes of a URDF, from the folders of installed packages."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from hrp2_description.data import share_folders
from numpy.typing import NDArray

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
