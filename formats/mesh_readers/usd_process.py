"""Process in which usd-core reads a stage.

Run: python -m place_rings.formats.mesh_readers.usd_process FILE

It writes to stdout a line: "refused", then why; or "ok", then in JSON the names of the parts, the
numbers of triangles up to the end of each, and why parts by their names have none, and the
triangles (T, 3, 3) m in NumPy's format.
"""

import json
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
from jaxtyping import Float

from ...coverage.definitions.errors import shown
from ..limited_process import limit, say_array
from .mesh_numbers import (
    AGAIN,
    MOST_PARTS,
    MOST_TRIANGLES,
    Y_UP,
    MeshError,
    bounded,
    fans,
    picked,
    placed,
)

Triangles = Float[np.ndarray, "T 3 3"]
_BYTES, _SECONDS = 2 << 30, 15  # of memory, and of processor time
_ARC = np.linspace(-np.pi / 2, np.pi / 2, 17)  # latitudes of a sphere
_AROUND = 32  # sides of what is round
_FLAT = "export it flattened"
_CLIPS = ("clips", "clipSets")  # values from other files


class UnknownSurfaceError(MeshError):
    """A prim has a surface of a kind that is not read."""


def main() -> None:
    """Write the parts, or why there are none."""
    limit(_BYTES, _SECONDS)
    out = sys.stdout.buffer
    try:
        parts, refused = _parts(sys.argv[1])
    except Exception as error:  # whatever a parser of a broken file raises
        why = f"OpenUSD that can be read ({type(error).__name__}); {AGAIN}"
        out.write(b"refused\n" + (str(error) if isinstance(error, MeshError) else why).encode())
        return
    ends = np.cumsum([len(part) for part in parts.values()], dtype=int).tolist()
    out.write(b"ok\n" + json.dumps([list(parts), ends, refused]).encode() + b"\n")
    say_array(np.concatenate([np.zeros((0, 3, 3)), *parts.values()]))


def _parts(file: str) -> tuple[dict[str, Triangles], dict[str, str]]:
    """Return the parts of a file, and why some of them cannot be read; these are empty."""
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(_layer(file))
    if set(stage.GetUsedLayers()) - {stage.GetRootLayer(), stage.GetSessionLayer()}:
        raise MeshError(f"one file without others; {_FLAT}")
    unit, y_up = UsdGeom.GetStageMetersPerUnit(stage), UsdGeom.GetStageUpAxis(stage) == "Y"
    if not 0 < unit < np.inf:
        raise MeshError(f"metersPerUnit above 0 (it is {unit:g}); {AGAIN}")
    to_base = np.diag([unit, unit, unit, 1.0])
    to_base = Y_UP @ to_base if y_up else to_base
    time = Usd.TimeCode.EarliestTime()  # the first frame, or what is not animated
    poses, parts, total = UsdGeom.XformCache(time), dict[str, Triangles](), 0
    refused = dict[str, str]()
    for prim in _shown(stage, time):
        name = str(prim.GetPath()).lstrip("/")
        try:
            triangles = _triangles(prim, time)
        except UnknownSurfaceError as error:
            triangles, refused[name] = np.zeros((0, 3, 3)), str(error)
        total += len(triangles)
        bounded(total, MOST_TRIANGLES, "triangles")
        T = np.array(poses.GetLocalToWorldTransform(prim)).T  # USD has row vectors
        triangles = placed(triangles, to_base @ T)
        if not np.isfinite(triangles).all():
            raise MeshError(f"prims of finite transforms; {AGAIN}")
        parts[name] = triangles
    return parts, refused


def _layer(file: str) -> Any:
    """Return the file's layer, which names no other file that would be opened."""
    from pxr import Sdf

    layer, paths = Sdf.Layer.OpenAsAnonymous(file), list[Any]()
    if named := [n for n in layer.GetCompositionAssetDependencies() if n]:
        raise MeshError(f"one file without others (it names {shown(named[0])}); {_FLAT}")
    layer.Traverse(Sdf.Path.absoluteRootPath, paths.append)
    if any(layer.GetObjectAtPath(p).HasInfo(c) for p in paths if p.IsPrimPath() for c in _CLIPS):
        raise MeshError(f"one file without others (it has value clips); {_FLAT}")
    return layer


def _shown(stage: Any, time: Any) -> Iterator[Any]:
    """Yield the prims with a surface that are neither invisible nor guides."""
    from pxr import Usd, UsdGeom

    prims = Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies())
    for n, prim in enumerate(prims):
        bounded(n, MOST_PARTS, "prims")
        if not any(prim.IsA(t) for t in (UsdGeom.Gprim, UsdGeom.PointInstancer)):
            continue
        seen = UsdGeom.Imageable(prim)
        guide = seen.ComputePurpose() == UsdGeom.Tokens.guide
        if not guide and seen.ComputeVisibility(time) != UsdGeom.Tokens.invisible:
            yield prim


def _triangles(prim: Any, time: Any) -> Triangles:
    """Return the triangles (T, 3, 3) of a prim in its frame; curves and points have none."""
    import trimesh
    from pxr import UsdGeom

    def value(name: str) -> Any:
        return prim.GetAttribute(name).Get(time)

    kind = prim.GetTypeName()
    if kind == "Mesh":
        return _mesh(value)
    if kind == "Cube":
        return np.array(trimesh.creation.box([value("size")] * 3).triangles)
    if kind in ("Plane", "Sphere", "Cylinder", "Cone", "Capsule"):
        if kind == "Plane":
            x, y = value("width") / 2, value("length") / 2
            corners = np.array([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0]])
            made = corners[[[0, 1, 2], [0, 2, 3]]]
        else:
            profile = _profile(kind, value)
            made = np.array(trimesh.creation.revolve(profile, sections=_AROUND).triangles)
        axis = "Z" if kind == "Sphere" else value("axis")
        return np.roll(made, {"X": 1, "Y": 2}.get(axis, 0), axis=2)
    if prim.IsA(UsdGeom.Curves) or kind == "Points":
        return np.zeros((0, 3, 3))
    raise UnknownSurfaceError(f"surfaces as meshes ({prim.GetName():.60} is a {kind}); {AGAIN}")


def _mesh(value: Any) -> Triangles:
    """Return the triangles of a mesh; polygons become fans, and what is subdivided stays as it
    is."""
    names = ("points", "faceVertexCounts", "faceVertexIndices")
    points, counts, corners = (np.array([] if (v := value(n)) is None else v) for n in names)
    if counts.sum() != len(corners):
        raise MeshError(f"{counts.sum():g} corners, as it states (it has {len(corners)}); {AGAIN}")
    index = corners.astype(np.int64)[fans(counts.astype(np.int64))]
    made = picked(points.astype(float).reshape(-1, 3), index)
    return made[:, ::-1] if value("orientation") == "leftHanded" else made


def _profile(kind: str, value: Any) -> Float[np.ndarray, "N 2"]:
    """Return the outline (radius, z) of a round shape, from its lowest point to its highest."""
    radius = value("radius")
    arc: np.ndarray = radius * np.stack([np.cos(_ARC), np.sin(_ARC)], axis=1).round(12)
    if kind == "Sphere":
        return arc
    half = value("height") / 2
    if kind == "Capsule":
        up, middle = np.array([0, half]), len(arc) // 2
        low, high = arc[: middle + 1] - up, arc[middle:] + up
        return np.concatenate([low, high])
    top = [[radius, half]] if kind == "Cylinder" else []
    return np.array([[0, -half], [radius, -half], *top, [0, half]])


if __name__ == "__main__":
    main()
