"""Shapes of an MJCF file: primitive ones, and meshes."""

from dataclasses import dataclass
from pathlib import PurePosixPath

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from ...coverage.robots.kinematics import transform
from ..errors import shown
from .mjcf_text import MAIN, MjcfText, turn_to
from .urdf_model import UrdfShape

_SIZES = {"sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "box": 3}
_UNBOUNDED = ("plane", "hfield", "sdf")


@dataclass(frozen=True)
class MeshAsset:
    """A mesh of a file."""

    file: str
    """Its file, relative to the folder of the MJCF file; empty for vertices in the file itself."""
    scale: tuple[float, float, float]
    """Scale along x, y and z."""
    T_shape_file: Float[np.ndarray, "4 4"]
    """Pose of the scaled mesh in its shape's frame."""


def meshes_of(text: MjcfText) -> dict[str, MeshAsset]:
    """Return the meshes of a file by name.

    Raises:
        UserError: for a mesh that is not supported.
    """
    meshes = {}
    for asset in text.root.findall("asset"):
        for element in asset.findall("mesh"):
            keys = text.attributes(element, MAIN, "mesh")
            file = keys.get("file", "")
            plain = PurePosixPath(file.replace("\\", "/"))
            name = keys.get("name") or plain.stem
            where = f"mesh {shown(name)}"
            if file and text.compiler.bare:
                plain = PurePosixPath(plain.name)
            if file and not plain.is_absolute():
                plain = PurePosixPath(text.compiler.meshdir.replace("\\", "/")) / plain
            scale = text.numbers(keys.get("scale", "1 1 1"), [3], f"{where}: scale")
            if not scale.all():
                raise text.fail(f"{where}: scale", keys["scale"], "three numbers other than 0")
            x, y, z = (float(v) for v in scale)
            place = _place(text, keys, scale, where)
            meshes[name] = MeshAsset(plain.as_posix() if file else "", (x, y, z), place)
    return meshes


def _place(
    text: MjcfText, keys: dict[str, str], scale: Float[np.ndarray, " 3"], where: str
) -> Float[np.ndarray, "4 4"]:
    """Return the pose of a mesh that ``refpos`` and ``refquat`` state."""
    origin = text.numbers(keys.get("refpos", "0 0 0"), [3], f"{where}: refpos")
    w, *xyz = text.numbers(keys.get("refquat", "1 0 0 0"), [4], f"{where}: refquat")
    if not (w or any(xyz)):
        raise text.fail(f"{where}: refquat", keys["refquat"], "four numbers, not all 0")
    T = np.eye(4)
    T[:3, :3] = Rotation.from_quat([*xyz, w]).as_matrix().T
    if any(xyz) and np.ptp(scale) > 1e-12:
        raise text.fail(f"{where}: refquat", keys["refquat"], "none, where the scale is uneven")
    return np.asarray(T @ transform(-origin * scale))


def shape_of(
    text: MjcfText,
    keys: dict[str, str],
    T: Float[np.ndarray, "4 4"],
    meshes: dict[str, MeshAsset],
    where: str,
) -> UrdfShape | None:
    """Return the shape of a geom in its body's frame; None for planes and terrain, and for shapes
    without size.

    Args:
        text: the file.
        keys: attributes of the geom.
        T: pose of the frame in which the geom is stated.
        meshes: the file's meshes.
        where: the geom, for messages.

    Raises:
        UserError: for a geom that is not supported.
    """
    kind = keys.get("type", "mesh" if "mesh" in keys else "sphere")
    if kind in _UNBOUNDED:
        return None
    if kind != "mesh" and kind not in _SIZES:
        raise text.fail(f"{where}: type", kind, ", ".join((*_SIZES, "mesh", *_UNBOUNDED)))
    if "mesh" in keys:  # also for a primitive shape, which MuJoCo would fit to the mesh
        mesh = meshes.get(keys["mesh"])
        if mesh is None:
            raise text.fail(f"{where}: mesh", keys["mesh"], "a mesh of the file's assets")
        if not mesh.file:
            raise text.fail(f"{where}: mesh", keys["mesh"], "a mesh with a file")
        place = T @ text.pose(keys, where) @ mesh.T_shape_file
        return UrdfShape("mesh", place, mesh.scale, mesh.file)
    if kind == "mesh":
        raise text.fail(f"{where}: mesh", None, "the name of a mesh")
    size = text.numbers(keys.get("size", "0"), [1, 2, 3], f"{where}: size")
    place = text.pose(keys, where)
    if "fromto" in keys and kind != "sphere":
        ends = text.numbers(keys["fromto"], [6], f"{where}: fromto").reshape(2, 3)
        way = ends[0] - ends[1]
        length = float(np.linalg.norm(way))
        if length == 0:
            return None
        place = np.eye(4)
        place[:3, :3], place[:3, 3] = turn_to(way), ends.mean(axis=0)
        round_ = kind in ("capsule", "cylinder")
        across = [size[0]] if round_ else [size[0], size[1] if len(size) > 1 else size[0]]
        size = np.array([*across, length / 2])
    if len(size) < _SIZES[kind]:
        raise text.fail(f"{where}: size", keys.get("size"), f"{_SIZES[kind]} numbers")
    size = size[: _SIZES[kind]]
    if (size <= 0).any():
        return None
    if kind == "box":
        size = 2 * size
    elif kind in ("capsule", "cylinder"):
        size = np.array([size[0], 2 * size[1]])
    return UrdfShape(kind, T @ place, tuple(float(v) for v in size))
