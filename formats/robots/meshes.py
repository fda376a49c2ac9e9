"""Surfaces of a URDF's links as triangles: meshes from permitted folders, and primitive shapes."""

import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import trimesh
from jaxtyping import Float

from ...coverage.choices import Surface
from ...coverage.definitions.errors import shown
from ..mesh_readers.collada import read_collada
from ..mesh_readers.gltf import read_gltf
from ..mesh_readers.mesh_numbers import MOST_TRIANGLES, MeshError, placed
from ..mesh_readers.obj import read_obj
from ..mesh_readers.stl import read_stl
from .packages import MissingFileError, Packages
from .urdf_folding import Carried
from .urdf_model import UrdfShape
from .xml_text import bounded_bytes, plain_xml

FORMATS = (".stl", ".dae", ".obj", ".gltf", ".glb")
LARGEST = 128 * 2**20  # bytes, largest mesh file
FAR = 20.0  # m, largest distance of a shape from its link's frame


class Meshes:
    """Reader of the meshes of one URDF, in the folders that ``Packages`` permits.

    Args:
        path: the URDF.
        packages: folders, chosen by the user, that are packages or hold packages.
        named: folders of packages by the packages' names.
        addresses: all names of meshes in the URDF.
        skip_missing: whether to leave out meshes whose file does not exist.
    """

    def __init__(
        self,
        path: Path,
        packages: Sequence[Path] = (),
        named: Mapping[str, Path] | None = None,
        addresses: Sequence[str] = (),
        skip_missing: bool = False,
    ) -> None:
        self.path, self.packages = path, Packages(path, packages, named, addresses)
        self.find, self._fail = self.packages.find, self.packages.fail
        self._read: dict[Path, Float[np.ndarray, "T 3 3"]] = {}
        self._skip, self._skipped = skip_missing, dict[str, str]()  # link by name of the file

    @property
    def notes(self) -> tuple[str, ...]:
        """A sentence about each mesh that is left out, and about meshes under other names."""
        missing = (
            f"Mesh {shown(name.rpartition('/')[2])} does not exist and is left out: the body of"
            f" link {shown(link)} is incomplete."
            for name, link in self._skipped.items()
        )
        return (*self.packages.notes, *missing)

    def _of_file(self, name: str, link: str) -> Float[np.ndarray, "T 3 3"]:
        """Return the triangles of a mesh; none of a missing file that may be left out."""
        try:
            file = self.find(name, link)
        except MissingFileError:
            if not self._skip:
                raise
            self._skipped.setdefault(name, link)
            return np.zeros((0, 3, 3))
        return self._triangles(file, name, link)

    def _triangles(self, file: Path, name: str, link: str) -> Float[np.ndarray, "T 3 3"]:
        if file in self._read:
            return self._read[file]
        kind, where = file.suffix.lower(), f"{self.path}: link {shown(link)}: mesh {shown(name)}"
        if kind not in FORMATS:
            raise self._fail(
                link, name, f"a mesh of the format {', '.join(f[1:] for f in FORMATS)}"
            )
        data = bounded_bytes(file, LARGEST, where)
        try:
            if kind == ".dae":
                root = plain_xml(data, where)
                triangles = self._metres(root, name, link) * read_collada(root)
            elif kind in (".gltf", ".glb"):
                triangles = read_gltf(data, lambda uri: _beside(file, uri, where))
            else:
                triangles = (read_stl if kind == ".stl" else read_obj)(data)
        except MeshError as error:
            raise self._fail(link, name, str(error)) from error
        if not len(triangles) and kind != ".stl":  # which may state that it has none
            raise self._fail(link, name, f"1 to {MOST_TRIANGLES} triangles (it has 0)")
        self._read[file] = triangles
        return triangles

    def _metres(self, root: ET.Element, name: str, link: str) -> float:
        """Return the unit of a COLLADA file, m."""
        unit = root.find("asset/unit")
        text = "1" if unit is None else unit.get("meter", "1")
        try:
            metres = float(text)
        except ValueError:
            metres = math.nan
        if not 0 < metres < math.inf:
            raise self._fail(
                link, name, f"a unit of some metres (its unit has meter={shown(text)})"
            )
        return metres

    def shape(self, shape: UrdfShape, link: str) -> Float[np.ndarray, "T 3 3"]:
        """Return triangles (T, 3, 3) m of a shape in its link's frame; a round shape is enclosed in
        a polyhedron with 64 sides."""
        if shape.kind == "mesh":
            points = placed(self._of_file(shape.file, link), np.diag([*shape.size, 1.0]))
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
            moved: np.ndarray = points @ T[:3, :3].T + T[:3, 3]
        far = float(np.nan_to_num(np.abs(moved), nan=np.inf).max(initial=0.0))
        if far > FAR:
            where = f"{shape.file or shape.kind}, {far:.3g} m from the link's frame"
            raise self._fail(
                link, where, f"at most {FAR:g} m (a mesh in millimetres has scale 0.001)"
            )
        return moved

    def surface(self, carried: Carried, which: Surface) -> Float[np.ndarray, "T 3 3"]:
        """Return triangles (T, 3, 3) m of a link's shapes in the chain's frame, of the kind
        ``which`` or, if it has none of these, of the other."""
        return self.used_surface(carried, which)[1]

    def used_surface(
        self, carried: Carried, which: Surface
    ) -> tuple[Surface, Float[np.ndarray, "T 3 3"]]:
        """Return the kind of the shapes that ``surface`` takes, and its triangles."""
        other: Surface = "visual" if which == "collision" else "collision"
        for kind in (which, other):
            triangles = self.kind(carried, kind)
            if len(triangles):
                return kind, triangles
        return which, np.zeros((0, 3, 3))

    def kind(self, carried: Carried, which: Surface) -> Float[np.ndarray, "T 3 3"]:
        """Return triangles (T, 3, 3) m of a link's shapes of one kind in the chain's frame; none
        where it has no such shapes, or only meshes of no triangles."""
        link = carried.link
        shapes = link.shapes(which)
        if not shapes:
            return np.zeros((0, 3, 3))
        triangles = np.concatenate([self.shape(shape, link.name) for shape in shapes])
        R, origin = carried.T_frame_link[:3, :3], carried.T_frame_link[:3, 3]
        points: np.ndarray = triangles @ R.T + origin
        if len(points) and np.ptp(points.reshape(-1, 3), axis=0).max() < 1e-6:
            raise self._fail(link.name, shapes[0].file or shapes[0].kind, "a shape with an extent")
        return points


def _beside(file: Path, uri: str, where: str) -> bytes:
    """Return the content of a file in a mesh's folder or below, as its ``uri`` names it."""
    try:
        path = (file.parent / unquote(uri)).resolve()
        there = path.is_relative_to(file.parent) and path.is_file()
    except (OSError, ValueError, RuntimeError):
        there = False
    if not there:
        raise MeshError(f"a mesh whose files lie in its folder ({shown(uri)} does not)")
    return bounded_bytes(path, LARGEST, f"{where}: {shown(uri)}")
