"""Reader of the closed meshes that targets name."""

from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ..coverage.definitions.errors import InputError, UserError, shown
from ..coverage.definitions.field_types import FARTHEST
from ..coverage.targets.own import MOST_FACES, Mesh
from .obstacle_meshes import mesh_in

_DIGITS = 9  # decimals of a corner's coordinates, m, in a file


def closed_mesh(
    where: str, path: Path, data: bytes, scale: float, T: Float[np.ndarray, "4 4"]
) -> Mesh:
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
    mesh = mesh_in(where, path.name, data)
    mesh.merge_vertices()
    corners, faces = np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64)
    corners = np.round(corners * scale @ T[:3, :3].T + T[:3, 3], _DIGITS)
    if corners.size and not np.abs(corners).max() <= FARTHEST:
        raise UserError(
            f"{where}: {shown(path.name)} lies beyond {FARTHEST:g} m; check its scale and centre"
        )
    try:
        return Mesh(corners, _whole(corners, faces))
    except InputError as error:
        line = str(error).removeprefix("Mesh: ")
        raise UserError(f"{where}: {shown(path.name)}: {line}") from error


def _whole(corners: Float[np.ndarray, "V 3"], faces: Int[np.ndarray, "T 3"]) -> Any:
    """Return the triangles that span an area; rounded corners may coincide."""
    if len(faces) > MOST_FACES:
        return faces
    a, b, c = corners[faces].transpose(1, 0, 2)
    return faces[(a != b).any(axis=1) & (b != c).any(axis=1) & (c != a).any(axis=1)]
