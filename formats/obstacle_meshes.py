"""Reader of the meshes that a scene names: obstacles, and what is attached to the robot."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ..coverage.definitions.errors import UserError, shown
from ..coverage.definitions.field_types import FARTHEST, LONGEST_NAME
from ..coverage.robots.attached import Attached
from ..coverage.solids.polyhedra import MOST_FACES, hull
from ..objectives.scene import Obstacle, Scene
from ..objectives.turned_cell import turned_attached, turned_obstacle
from .mesh_readers.mesh_numbers import MeshError
from .mesh_readers.scene_mesh import read_scene_mesh
from .schema.attached_models import AttachedModel
from .schema.convex_models import ConvexModel
from .schema.obstacle_models import ObstacleModel
from .stand_ins import refuse_stand_in

MESHES = ("stl", "ply", "off", "obj")
Model = TypeVar("Model", bound=ConvexModel)
_PIECES = 64  # most separate parts of a mesh
_DIGITS = 9  # decimals of a corner's coordinates, m, in a file


def with_meshes(
    scene: Scene, models: list[ObstacleModel], where: str, read: Any, turn: bool
) -> Scene:
    """Return ``scene`` with the meshes of its file; each connected part counts by its convex hull.

    Args:
        scene: the scene with the obstacles that need no file.
        models: all obstacles of the file.
        where: file and key of the obstacles, for messages.
        read: returns path and bytes of a mesh file, from the key and the file name.
        turn: whether the file's base is turned by 180° about z in the scene's.

    Raises:
        UserError: if a mesh cannot be used.
    """
    parts = [part for _, part in _all_parts(models, where, read)]
    parts = [turned_obstacle(part) for part in parts] if turn else parts
    return replace(scene, obstacles=(*scene.obstacles, *parts))


def with_attached_meshes(
    scene: Scene, models: list[AttachedModel], where: str, read: Any, turn: bool
) -> Scene:
    """Return ``scene`` with the attached meshes of its file; each connected part counts by its
    convex hull. For arguments and errors see ``with_meshes``."""
    attached = [
        Attached(part.name, model.link, part.body, {**part.keys, "link": model.link}, part.hulled)
        for model, part in _all_parts(models, where, read)
    ]
    if not attached:
        return scene
    attached = [turned_attached(part) for part in attached] if turn else attached
    robot = scene.robot.with_attached((*scene.robot.attached, *attached))
    return replace(scene, robot=robot)


def _all_parts(models: Sequence[Model], where: str, read: Any) -> Iterator[tuple[Model, Obstacle]]:
    """Yield the connected parts of all meshes, each with the table that names its mesh."""
    for i, model in enumerate(models):
        if model.file is not None:
            key = f"{where}[{i}].file"
            for part in _parts(model, key, *read(key, model.file)):
                yield model, part


def mesh_in(where: str, name: str | None, data: bytes) -> Any:
    """Return the mesh in a file that a scene or a target names.

    Args:
        where: file and key that name it, for messages.
        name: name of the file.
        data: its content.

    Raises:
        UserError: if it is none.
    """
    kind = Path(name or "").suffix.lower().lstrip(".")
    if kind not in MESHES:
        allowed = ", ".join("." + mesh for mesh in MESHES)
        raise UserError(f"{where}: found {shown(name)}, allowed: a mesh, {allowed}")
    refuse_stand_in(data, f"{where}: {shown(name)}")
    try:
        return read_scene_mesh(kind, data)
    except MeshError as error:
        raise UserError(f"{where}: {shown(name)}: allowed: {error}") from error


def _parts(model: ConvexModel, key: str, path: Path, data: bytes) -> list[Obstacle]:
    import trimesh  # slow to load

    mesh = mesh_in(key, model.file, data)
    parts = trimesh.graph.connected_component_labels(mesh.face_adjacency, len(mesh.faces))
    if not 0 < (count := int(parts.max(initial=-1)) + 1) <= _PIECES:
        raise UserError(f"{key}: found {count} separate parts, allowed: 1 to {_PIECES}")
    pieces = list(mesh.split(only_watertight=False))
    T, obstacles = model.transform, []
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
        name = (model.name or path.stem)[: LONGEST_NAME - len(part)] + part
        keys = {"name": name, "points": corners.tolist()}
        obstacles.append(Obstacle(name, hull(corners), keys, hulled=not bool(piece.is_convex)))
    return obstacles
