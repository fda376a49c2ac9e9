"""Surfaces of a URDF's links as triangles: meshes from permitted folders, and primitive shapes."""

import io
from collections.abc import Sequence
from pathlib import Path, PurePosixPath
from typing import Any
from urllib.parse import unquote

import numpy as np
import trimesh
from jaxtyping import Float

from ...coverage.choices import Surface
from ..errors import UserError, shown
from .urdf import UrdfShape, bounded_bytes, plain_xml
from .urdf_chain import Carried

FORMATS = (".stl", ".dae", ".obj")
LARGEST = 128 * 2**20  # bytes, largest mesh file
MOST_TRIANGLES = 3_000_000
FAR = 20.0  # m, largest distance of a shape from its link's frame


class Meshes:
    """Reader of the meshes of one URDF.

    A file is read only if it lies, with symbolic links resolved, in one of the ``packages`` or in
    the URDF's folder.

    Args:
        path: the URDF.
        packages: folders, chosen by the user, that are packages or hold packages.
    """

    def __init__(self, path: Path, packages: Sequence[Path] = ()) -> None:
        self.path = path
        for folder in packages:
            if not folder.is_dir():
                raise UserError(f"--packages: found {shown(str(folder))}, allowed: a folder")
        self.folders = [path.resolve().parent, *(folder.resolve() for folder in packages)]
        self._read: dict[Path, Float[np.ndarray, "T 3 3"]] = {}

    def _fail(self, link: str, found: str, allowed: str) -> UserError:
        return UserError(
            f"{self.path}: link {shown(link)}: mesh: found {shown(found)}, allowed: {allowed}"
        )

    def find(self, name: str, link: str) -> Path:
        """Return the file of a mesh name.

        Raises:
            UserError: if it does not exist, or lies outside the permitted folders.
        """
        scheme, colon, rest = name.partition("://")
        given = ", ".join(f.name or "/" for f in self.folders)
        if colon and scheme not in ("package", "file", "model"):
            raise self._fail(link, name, "package://, file:// or a path")
        text = unquote(rest) if colon else name
        if "\0" in text:
            raise self._fail(link, name, "a file's name")
        wanted = PurePosixPath(text.replace("\\", "/"))
        options: list[Path] = []
        if colon and scheme in ("package", "model"):
            package, *inside = wanted.parts or ("",)
            for folder in self.folders:
                options.append(folder / wanted)
                options += [
                    up.joinpath(*inside) for up in (folder, *folder.parents) if up.name == package
                ]
        else:
            options += (
                [Path(wanted)]
                if wanted.is_absolute()
                else [folder / wanted for folder in self.folders]
            )
        outside = False
        for option in options:
            try:
                real = option.resolve()
                there = real.is_file()
            except (OSError, ValueError, RuntimeError):
                continue
            if there and any(real.is_relative_to(folder) for folder in self.folders):
                return real
            outside |= there or not any(real.is_relative_to(folder) for folder in self.folders)
        where = f"a file in {given}" + ", or in a folder given by --packages"
        raise self._fail(link, name, where if not outside else where + "; this one is outside")

    def _triangles(self, file: Path, name: str, link: str) -> Float[np.ndarray, "T 3 3"]:
        if file in self._read:
            return self._read[file]
        kind = file.suffix.lower()
        if kind not in FORMATS:
            raise self._fail(
                link, name, f"a mesh of the format {', '.join(f[1:] for f in FORMATS)}"
            )
        data = bounded_bytes(file, LARGEST, f"{self.path}: link {shown(link)}: mesh {shown(name)}")
        if kind == ".dae":
            plain_xml(data, f"{self.path}: link {shown(link)}: mesh {shown(name)}")
        try:
            # Without a resolver, trimesh opens no other file (material, texture).
            mesh: Any = trimesh.load(
                io.BytesIO(data), file_type=kind[1:], resolver=None, process=False, force="mesh"
            )
            triangles = np.array(mesh.triangles, np.float64).reshape(-1, 3, 3)
        except Exception as error:  # whatever a parser of a broken file raises
            raise self._fail(
                link, name, f"a mesh that can be read ({type(error).__name__})"
            ) from error
        if not 0 < len(triangles) <= MOST_TRIANGLES or not np.isfinite(triangles).all():
            raise self._fail(
                link,
                name,
                f"1 to {MOST_TRIANGLES} triangles of finite numbers (it has {len(triangles)})",
            )
        self._read[file] = triangles
        return triangles

    def shape(self, shape: UrdfShape, link: str) -> Float[np.ndarray, "T 3 3"]:
        """Return triangles (T, 3, 3) m of a shape in its link's frame; a round shape is enclosed in
        a polyhedron with 64 sides."""
        if shape.kind == "mesh":
            with np.errstate(over="ignore"):
                points = self._triangles(self.find(shape.file, link), shape.file, link) * np.array(
                    shape.size
                )
        elif shape.kind == "box":
            points = np.asarray(trimesh.creation.box(extents=shape.size).triangles)
        elif shape.kind in ("sphere", "ellipsoid"):  # one radius, or three
            ball = trimesh.creation.icosphere(3, 1 / 0.985)
            points = np.asarray(ball.triangles) * np.array(shape.size)
        elif shape.kind == "cylinder":
            around = shape.size[0] / np.cos(np.pi / 64)
            points = np.asarray(
                trimesh.creation.cylinder(around, shape.size[1], sections=64).triangles
            )
        else:
            around = shape.size[0] / np.cos(np.pi / 64)
            made = trimesh.creation.capsule(shape.size[1], around, count=[64, 64])
            points = np.asarray(made.triangles) - [0, 0, float(made.bounds.mean(axis=0)[2])]
        T = shape.T_link_shape
        with np.errstate(over="ignore", invalid="ignore"):
            placed: np.ndarray = points @ T[:3, :3].T + T[:3, 3]
        far = float(np.nan_to_num(np.abs(placed), nan=np.inf).max())
        if far > FAR:
            where = f"{shape.file or shape.kind}, {far:.3g} m from the link's frame"
            raise self._fail(
                link, where, f"at most {FAR:g} m (a mesh in millimetres has scale 0.001)"
            )
        return placed

    def surface(self, carried: Carried, which: Surface) -> Float[np.ndarray, "T 3 3"]:
        """Return triangles (T, 3, 3) m of a link's shapes in the chain's frame, of the kind
        ``which`` or else of the other."""
        link = carried.link
        shapes = (
            (link.collision or link.visual)
            if which == "collision"
            else (link.visual or link.collision)
        )
        if not shapes:
            return np.zeros((0, 3, 3))
        triangles = np.concatenate([self.shape(shape, link.name) for shape in shapes])
        R, origin = carried.T_frame_link[:3, :3], carried.T_frame_link[:3, 3]
        points: np.ndarray = triangles @ R.T + origin
        if np.ptp(points.reshape(-1, 3), axis=0).max() < 1e-6:
            raise self._fail(link.name, shapes[0].file or shapes[0].kind, "a shape with an extent")
        return points
