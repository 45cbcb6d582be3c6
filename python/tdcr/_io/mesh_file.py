"""Mesh files. Imported on first use by ``Mesh.load``.

trimesh is an optional extra (``pip install tdcr[mesh]``) and imported inside the function.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tdcr._core import Mesh
from tdcr.errors import InvalidInput

if TYPE_CHECKING:
    from trimesh import Trimesh

__all__ = ["load_mesh"]

_METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "um": 1e-6, "in": 0.0254}


def load_mesh(path: str | os.PathLike[str], unit: Any, inside: bool = False) -> Mesh:
    """Read a mesh file, see `Mesh.load`."""
    metres = _METRES.get(unit) if isinstance(unit, str) else None
    if metres is None:
        names = " or ".join(f'"{name}"' for name in _METRES)
        raise InvalidInput(f"unit: expected {names}, got {unit!r}", "unit")
    mesh = _read(Path(path))
    # A file's normals and texture coordinates split vertices; here only their places count.
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    faces = np.asarray(mesh.faces)
    # Triangles of which merging has left a line: their neighbours close over them.
    whole = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    try:
        return Mesh(np.asarray(mesh.vertices) * metres, faces[whole], inside=inside)
    except InvalidInput as error:
        raise InvalidInput(f"path: {path}: {error}", "path") from error


def _read(path: Path) -> Trimesh:
    try:
        import trimesh
    except ImportError as error:
        raise ImportError(
            "mesh files need trimesh, which is not installed: pip install tdcr[mesh]"
        ) from error
    with path.open("rb") as file:
        try:
            mesh = trimesh.load_mesh(file, file_type=path.suffix.lstrip(".").lower())
        except Exception as error:  # Readers raise whatever the broken file led them to.
            fault = f"{type(error).__name__}: {error}"
            raise InvalidInput(
                f"path: expected a mesh file that trimesh reads, got {path}: {fault}", "path"
            ) from error
    if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) == 0:
        raise InvalidInput(f"path: expected triangles, got none in {path}", "path")
    return mesh
