"""Reader of the closed meshes that targets name."""

import io
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ..coverage.volumes import MOST_FACES, MeshVolume
from .errors import UserError, shown
from .obstacle_meshes import MESHES
from .schema.field_types import FARTHEST

_DIGITS = 9  # decimals of a corner's coordinates, m, in a file


def closed_mesh(
    where: str, path: Path, data: bytes, scale: float, T: Float[np.ndarray, "4 4"]
) -> MeshVolume:
    """Return the closed mesh in a file.

    Args:
        where: file and key that name it, for messages.
        path: the file.
        data: its content.
        scale: length of one unit of the mesh, m.
        T: pose of the mesh in the base frame, m.

    Raises:
        UserError: if it cannot be read, is not closed, or is too large.
    """
    kind = path.suffix.lower().lstrip(".")
    if kind not in MESHES:
        allowed = ", ".join("." + mesh for mesh in MESHES)
        raise UserError(f"{where}: found {shown(path.name)}, allowed: a mesh, {allowed}")
    import trimesh  # slow to load

    try:
        mesh: Any = trimesh.load(io.BytesIO(data), file_type=kind, force="mesh", process=True)
        mesh.merge_vertices()
        corners, faces = np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64)
    except Exception as error:  # whatever a parser of foreign files raises
        raise UserError(
            f"{where}: {shown(path.name)} cannot be read as a mesh: {type(error).__name__}"
        ) from error
    corners = np.round(corners * scale @ T[:3, :3].T + T[:3, 3], _DIGITS)
    if corners.size and not np.abs(corners).max() <= FARTHEST:
        raise UserError(
            f"{where}: {shown(path.name)} lies beyond {FARTHEST:g} m; check its scale and centre"
        )
    try:
        return MeshVolume(corners, _whole(corners, faces))
    except ValueError as error:
        raise UserError(f"{where}: {shown(path.name)}: {error}") from error


def _whole(corners: Float[np.ndarray, "V 3"], faces: Int[np.ndarray, "T 3"]) -> Any:
    """Return the triangles that span an area; rounded corners may coincide."""
    if len(faces) > MOST_FACES:
        return faces
    a, b, c = corners[faces].transpose(1, 0, 2)
    return faces[(a != b).any(axis=1) & (b != c).any(axis=1) & (c != a).any(axis=1)]
