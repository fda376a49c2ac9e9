"""Triangles of one geometry in a COLLADA mesh."""

import xml.etree.ElementTree as ET
from collections.abc import Callable

import numpy as np
from jaxtyping import Float, Int

from .mesh_numbers import (
    AGAIN,
    MOST_TRIANGLES,
    MeshError,
    bounded,
    fans,
    numbers,
    picked,
    strips,
)

Triangles = Float[np.ndarray, "T 3 3"]
Named = Callable[[ET.Element, str, str], ET.Element]
SURFACES = ("triangles", "polylist", "polygons", "tristrips", "trifans")


class Points:
    """The points that surfaces name; each source is read once.

    Args:
        named: returns the element of a tag that an element's attribute names.
    """

    def __init__(self, named: Named) -> None:
        self._named = named
        self._read: dict[ET.Element, Float[np.ndarray, "V 3"]] = {}

    def of(self, vertex: ET.Element) -> Float[np.ndarray, "V 3"]:
        """Return the points (V, 3) that an input VERTEX names.

        Raises:
            MeshError: if there are none.
        """
        vertices = self._named(vertex, "source", "vertices")
        inputs = vertices.findall("input")
        position = next((i for i in inputs if i.get("semantic") == "POSITION"), None)
        if position is None:
            raise MeshError(f"vertices with an input POSITION; {AGAIN}")
        source = self._named(position, "source", "source")
        if source not in self._read:
            self._read[source] = _points(source)
        return self._read[source]


def _points(source: ET.Element) -> Float[np.ndarray, "V 3"]:
    """Return the points (V, 3) of a source."""
    accessor, array = source.find("technique_common/accessor"), source.find("float_array")
    if accessor is None or array is None:
        raise MeshError(f"sources with a float_array and an accessor; {AGAIN}")
    values: np.ndarray = numbers(array.text or "", np.float64, "points")
    count, begin = _whole(accessor, "count"), _whole(accessor, "offset")
    stride = _whole(accessor, "stride", 1)
    if stride < 3 or len(values) < begin + count * stride:
        raise MeshError(
            f"{begin + count * stride} coordinates, as it states (it has {len(values)}); {AGAIN}"
        )
    points: np.ndarray = values[begin : begin + count * stride].reshape(count, stride)[:, :3]
    return points


def geometry_triangles(geometry: ET.Element, points: Points) -> Triangles:
    """Return the triangles (T, 3, 3) of a geometry; polygons become fans.

    Args:
        geometry: the element.
        points: the points of the file.

    Raises:
        MeshError: if it has no mesh, lacks a part, or has too many triangles.
    """
    mesh = geometry.find("mesh")
    if mesh is None:
        raise MeshError(f"geometries with a mesh ({geometry.get('id', '')[:60]} has none); {AGAIN}")
    parts = [_triangles(part, points) for part in mesh if part.tag in SURFACES]
    bounded(sum(len(t) for t in parts), MOST_TRIANGLES, "triangles")
    return np.concatenate(parts) if parts else np.zeros((0, 3, 3))


def _triangles(part: ET.Element, points: Points) -> Triangles:
    """Return the triangles of one element of a mesh, such as ``polylist``."""
    inputs = part.findall("input")
    vertex = next((i for i in inputs if i.get("semantic") == "VERTEX"), None)
    if vertex is None:
        raise MeshError(f"{part.tag} with an input VERTEX; {AGAIN}")
    place, width = _whole(vertex, "offset"), 1 + max(_whole(i, "offset") for i in inputs)
    if part.find("ph") is not None:
        raise MeshError("polygons without holes; triangulate the mesh")
    texts = [p.text or "" for p in part.findall("p")]
    corners = _corners(" ".join(texts), width, place)
    if not len(corners):
        return np.zeros((0, 3, 3))
    rows = [len(text.split()) // width for text in texts]
    if sum(rows) != len(corners):
        raise MeshError(f"{width} numbers for each corner; {AGAIN}")
    index = corners[_order(part, rows)]
    if part.tag != "polygons" and part.get("count") is not None:
        count = {"triangles": len(index), "tristrips": len(rows), "trifans": len(rows)}
        number = count.get(part.tag, len((part.findtext("vcount") or "").split()))
        if (stated := _whole(part, "count")) != number:
            raise MeshError(f"{stated} {part.tag}, as it states (it has {number}); {AGAIN}")
    return picked(points.of(vertex), index)


def _order(part: ET.Element, rows: list[int]) -> Int[np.ndarray, "T 3"]:
    """Return the numbers (T, 3) of the corners of each triangle, among those of all ``rows``."""
    total = sum(rows)
    if part.tag == "triangles":
        if total % 3:
            raise MeshError(f"triangles of three corners (it has {total} in all); {AGAIN}")
        bounded(total // 3, MOST_TRIANGLES, "triangles")
        return np.arange(total).reshape(-1, 3)
    if part.tag == "tristrips":
        bounded(total, MOST_TRIANGLES, "triangles")
        return strips(np.array(rows))
    if part.tag == "polylist":
        counts: np.ndarray = numbers(part.findtext("vcount") or "", np.int64, "vcount")
        if counts.sum() != total:
            raise MeshError(f"{counts.sum()} corners, as it states (it has {total}); {AGAIN}")
        return fans(counts)
    return fans(np.array(rows))


def _corners(text: str, width: int, place: int) -> Int[np.ndarray, " C"]:
    """Return the numbers (C,) of the points of an element's corners."""
    values: np.ndarray = numbers(text, np.int64, "corners")
    if len(values) % width:
        raise MeshError(f"{width} numbers for each corner (it has {len(values)}); {AGAIN}")
    return values[place::width]


def _whole(element: ET.Element, key: str, default: int = 0) -> int:
    text = element.get(key, str(default))
    if not text.isdecimal() or len(text) > 9:
        raise MeshError(f"whole numbers as {key} (one is {text[:60]}); {AGAIN}")
    return int(text)
