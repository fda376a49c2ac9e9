"""Reader of the meshes that scenes and targets name: STL, PLY, OFF, OBJ, and glTF and OpenUSD with
parts."""

import io
import re
from typing import Any

from .gltf import gltf_parts
from .mesh_numbers import AGAIN, MOST_CORNERS, MOST_TRIANGLES, MeshError, bounded
from .obj import read_obj
from .stl import read_stl
from .usd import usd_parts

USD = ("usd", "usda", "usdc")
MESHES = ("stl", "ply", "off", "obj", "glb", "gltf", *USD)
_START = 65_536  # bytes that hold the header of a PLY or OFF file
_COUNT = re.compile(rb"^element[ \t]+(\w+)[ \t]+(\d+)", re.MULTILINE)


def read_scene_parts(kind: str, data: bytes) -> dict[str, Any]:
    """Return the parts of a file by their names, as meshes of trimesh with equal corners merged; a
    part that cannot be read is the MeshError that says why.

    Args:
        kind: one of ``MESHES``; all but glTF and OpenUSD have one part, without a name.
        data: the file.

    Raises:
        MeshError: if it cannot be read, or has too many triangles.
    """
    if kind in ("ply", "off"):
        return {"": _loaded(kind, data)}
    import trimesh  # slow to load

    parts: dict[str, Any]
    if kind in ("gltf", "glb"):
        parts = dict(reversed(gltf_parts(data, _alone).items()))  # from a stack: in file order
    elif kind in USD:
        parts = usd_parts(data)
    else:
        parts = {"": (read_stl if kind == "stl" else read_obj)(data)}
    if not any(isinstance(part, MeshError) or len(part) for part in parts.values()):
        raise MeshError(f"1 to {MOST_TRIANGLES} triangles (it has 0)")
    return {
        name: part
        if isinstance(part, MeshError)
        else trimesh.Trimesh(**trimesh.triangles.to_kwargs(part), process=True)
        for name, part in parts.items()
    }


def _alone(uri: str) -> bytes:
    raise MeshError(f"one file with all of its data, such as a .glb (it names {uri:.60})")


def _loaded(kind: str, data: bytes) -> Any:
    """Return the mesh in a PLY or OFF file."""
    import trimesh

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
