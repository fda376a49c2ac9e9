"""The closed mesh in a file as a target."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ._errors import InputError, input_errors
from .coverage.definitions.field_types import ORIGIN
from .coverage.robots.kinematics import transform
from .coverage.targets.own import Mesh, MeshFile


def _load(
    file: str | Path,
    *,
    scale: float = 1.0,
    centre: Sequence[float] = ORIGIN,
    rpy_deg: Sequence[float] = ORIGIN,
    parts: Sequence[str] = (),
    **keys: Any,
) -> Mesh:
    """Return the closed mesh in a file (.stl, .ply, .off, .obj, .glb, .usd).

    Args:
        file: path of the file.
        scale: length of one unit of the mesh, m.
        centre: origin of the mesh (x, y, z) in the base frame (``base`` of ``Scene``), m.
        rpy_deg: rotations about x, y and z of the base frame, in this order, degrees.
        parts: parts of a glTF or OpenUSD file that are taken, by the names of its nodes; all by
            default.
        keys: further arguments of a target, such as ``name`` and ``weight``.

    Returns:
        The target.

    Raises:
        InputError: if the file cannot be read or the mesh is not closed.
    """
    from .formats.scene_meshes import closed_mesh

    place: Any = {"centre": centre, "rpy_deg": rpy_deg}
    table = MeshFile(str(file), scale=scale, parts=tuple(parts), **place)
    T = transform(table.centre, np.radians(table.rpy_deg))
    try:
        data = Path(file).read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", "file", file) from error
    with input_errors():
        mesh = closed_mesh("file", Path(file), data, table.scale, T, table.parts)
    return Mesh(mesh.vertices, mesh.faces, **keys)


Mesh.load = staticmethod(_load)

__all__ = ["Mesh"]
