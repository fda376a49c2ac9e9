"""Reader of the meshes that scenes and targets name: obstacles, what is attached to the robot, and
closed targets."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ..coverage.definitions.errors import InputError, UserError, shown, unusable
from ..coverage.definitions.field_types import FARTHEST, LONGEST_NAME, ORIGIN
from ..coverage.robots.attached import Solid
from ..coverage.solids.polyhedra import MOST_FACES, hull
from ..coverage.targets.own import MOST_FACES as MOST_TRIANGLES
from ..coverage.targets.own import Mesh
from .mesh_readers.mesh_numbers import MeshError
from .mesh_readers.scene_mesh import MESHES, USD, read_scene_parts
from .optional_dependencies import require
from .stand_ins import refuse_stand_in

_NAMED = 12  # most names in a message
_PIECES = 64  # most separate parts of a mesh
_DIGITS = 9  # decimals of a corner's coordinates, m, in a file


def parts_of_meshes(solids: Sequence[Solid], where: str, read: Any) -> Iterator[Solid]:
    """Yield the connected parts of the meshes among a scene's solids, each by its convex hull.

    Args:
        solids: all solids of one key of the scene's file.
        where: file and key, for messages.
        read: returns path and bytes of a mesh file, from the key and the file name.

    Raises:
        UserError: if a mesh cannot be used.
    """
    for i, solid in enumerate(solids):
        if solid.file is not None:
            key = f"{where}[{i}].file"
            yield from _parts(solid, key, *read(key, solid.file))


def parts_in(
    where: str, name: str | None, data: bytes, patterns: Sequence[str] = ()
) -> dict[str, Any]:
    """Return the chosen parts of a mesh file that a scene or a target names, by their names.

    Args:
        where: file and key that name it, for messages.
        name: name of the file.
        data: its content.
        patterns: as in ``ConvexSolid.parts``.

    Raises:
        UserError: if it is no mesh, a pattern fits no part, or the chosen ones have no surface.
    """
    kind = Path(name or "").suffix.lower().lstrip(".")
    if kind not in MESHES:
        allowed = ", ".join("." + mesh for mesh in MESHES)
        raise UserError(f"{where}: found {shown(name)}, allowed: a mesh, {allowed}")
    refuse_stand_in(data, f"{where}: {shown(name)}")
    if kind in USD:
        require("usd", f"{where}: {shown(name)}", "pxr")
    try:
        parts = read_scene_parts(kind, data)
    except MeshError as error:
        raise UserError(f"{where}: {shown(name)}: allowed: {error}") from error
    chosen = _chosen(list(parts), patterns, where.removesuffix(".file"), name)
    if wrong := next((p for p in map(parts.get, chosen) if isinstance(p, MeshError)), None):
        raise UserError(f"{where}: {shown(name)}: allowed: {wrong}")
    solid = {part: parts[part] for part in chosen if len(parts[part].faces)}  # others are lines
    if not solid:
        raise UserError(f"{where}: {shown(name)}: found no triangle in the chosen parts")
    return solid


def _chosen(names: list[str], patterns: Sequence[str], key: str, file: str | None) -> list[str]:
    """Return the names of the parts that patterns choose, in the order of the file."""
    chosen = set(names) if not patterns or patterns[0].startswith("!") else set[str]()
    for i, pattern in enumerate(patterns):
        wanted = pattern.removeprefix("!")
        fits = {n for n in names for p in (n, *n.split("/")) if fnmatchcase(p, wanted)}
        if not fits:
            known = ", ".join(names[:_NAMED]) + f" and {len(names) - _NAMED} more" * (
                len(names) > _NAMED
            )
            raise unusable(f"{key}.parts[{i}]", pattern, f"a part of {file}: {known or 'none'}")
        chosen = chosen - fits if pattern.startswith("!") else chosen | fits
    if not chosen:
        raise unusable(f"{key}.parts", list(patterns), f"at least one part of {file}")
    return [name for name in names if name in chosen]


def _parts(model: Solid, key: str, path: Path, data: bytes) -> Iterator[Solid]:
    for part, mesh in parts_in(key, model.file, data, model.parts).items():
        words = (model.name, part.rpartition("/")[2])
        yield from _pieces(model, key, " ".join(filter(None, words)) or path.stem, mesh)


def _pieces(model: Solid, key: str, name: str, mesh: Any) -> Iterator[Solid]:
    """Yield the connected parts of a mesh, each by its convex hull."""
    import trimesh  # slow to load

    parts = trimesh.graph.connected_component_labels(mesh.face_adjacency, len(mesh.faces))
    if not 0 < (count := int(parts.max(initial=-1)) + 1) <= _PIECES:
        raise UserError(f"{key}: found {count} separate parts, allowed: 1 to {_PIECES}")
    pieces = list(mesh.split(only_watertight=False))
    T = model.transform
    for n, piece in enumerate(pieces):
        corners = np.asarray(piece.vertices, float) * model.scale
        try:
            if not np.isfinite(corners).all() or np.abs(corners).max() > FARTHEST:
                raise ValueError(f"corners lie beyond {FARTHEST:g} m; check scale")
            body = hull(corners, MOST_FACES)
        except ValueError as error:
            raise UserError(f"{key}: part {n} of {shown(model.file)}: {error}") from error
        corners = np.unique(body.edges.reshape(-1, 3), axis=0) @ T[:3, :3].T + T[:3, 3]
        corners = np.round(corners, _DIGITS)
        if np.abs(corners).max() > FARTHEST:
            raise UserError(
                f"{key}: part {n} of {shown(model.file)} lies beyond {FARTHEST:g} m; move it closer"
            )
        part = f" part {n}" if len(pieces) > 1 else ""
        called = name[: LONGEST_NAME - len(part)] + part
        placed: Any = {"file": None, "scale": 1.0, "centre": ORIGIN, "rpy_deg": ORIGIN, "parts": ()}
        hulled = not bool(piece.is_convex)
        yield replace(model, name=called, points=corners, hulled=hulled, **placed)


def closed_mesh(
    where: str,
    path: Path,
    data: bytes,
    scale: float,
    T: Float[np.ndarray, "4 4"],
    patterns: Sequence[str] = (),
) -> Mesh:
    """Return the closed mesh in a file.

    Args:
        where: file and key that name it, for messages.
        path: the file.
        data: its content.
        scale: length of one unit of the mesh, m.
        T: pose of the mesh in the base frame, m.
        patterns: as in ``ConvexSolid.parts``.

    Raises:
        UserError: if it cannot be read, is not closed, or is too large.
    """
    import trimesh  # slow to load

    parts = parts_in(where, path.name, data, patterns)
    mesh: Any = trimesh.util.concatenate(list(parts.values()))
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
    if len(faces) > MOST_TRIANGLES:
        return faces
    a, b, c = corners[faces].transpose(1, 0, 2)
    return faces[(a != b).any(axis=1) & (b != c).any(axis=1) & (c != a).any(axis=1)]
