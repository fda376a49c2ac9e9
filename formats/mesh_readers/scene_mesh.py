"""Reader of the meshes that scenes and targets name: STL, PLY, OFF and OBJ."""

import io
import re
from typing import Any

from .mesh_numbers import AGAIN, MOST_CORNERS, MOST_TRIANGLES, MeshError, bounded
from .obj import read_obj
from .stl import read_stl

_START = 65_536  # bytes that hold the header of a PLY or OFF file
_COUNT = re.compile(rb"^element[ \t]+(\w+)[ \t]+(\d+)", re.MULTILINE)


def read_scene_mesh(kind: str, data: bytes) -> Any:
    """Return the mesh in a file, as one of trimesh with equal corners merged.

    Args:
        kind: stl, ply, off or obj.
        data: the file.

    Raises:
        MeshError: if it cannot be read, or has too many triangles.
    """
    import trimesh  # slow to load

    if kind in ("stl", "obj"):
        triangles = (read_stl if kind == "stl" else read_obj)(data)
        if not len(triangles):
            raise MeshError(f"1 to {MOST_TRIANGLES} triangles (it has 0)")
        return trimesh.Trimesh(**trimesh.triangles.to_kwargs(triangles), process=True)
    _bound_counts(kind, data)
    try:
        mesh: Any = trimesh.load(io.BytesIO(data), file_type=kind, force="mesh", process=True)
        if not len(mesh.faces):  # a cloud of points has no such field
            raise ValueError("no triangles")
        return mesh
    except Exception as error:  # whatever a parser of foreign files raises
        raise MeshError(f"a mesh that can be read ({type(error).__name__}); {AGAIN}") from error


def _bound_counts(kind: str, data: bytes) -> None:
    """Refuse a PLY or OFF file with too many points, triangles or corners of a polygon."""
    start = data[:_START]
    if kind == "ply":
        head = start.partition(b"end_header")[0]
        counts = [(name.decode(), int(n)) for name, n in _COUNT.findall(head)]
    else:
        numbers = re.findall(rb"\b\d+\b", re.sub(rb"#[^\n]*", b"", start))[:2]
        counts = list(zip(("vertex", "face"), map(int, numbers), strict=False))
    for name, count in counts:
        points = name == "vertex"
        bounded(count, 3 * MOST_TRIANGLES if points else MOST_TRIANGLES, f"elements {name}")
        if count > len(data):
            raise MeshError(
                f"a whole file (it is cut short: {count} elements {name} in {len(data)} bytes);"
                f" {AGAIN}"
            )
    if kind == "off" or b"ascii" in start[:200]:
        longest = max((line.count(b" ") for line in data.split(b"\n")), default=0)
        bounded(longest, MOST_CORNERS, "numbers in a line")
