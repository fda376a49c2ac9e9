"""Reader of STL meshes, binary and in text."""

import re

import numpy as np
from jaxtyping import Float

from .mesh_numbers import AGAIN, MOST_TRIANGLES, MeshError, bounded, numbers, picked

_HEADER = 84  # bytes of a binary file before its triangles
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_VERTEX = re.compile(rb"\bvertex[ \t]+(\S+[ \t]+\S+[ \t]+\S+)")


def read_stl(data: bytes) -> Float[np.ndarray, "T 3 3"]:
    """Return the triangles (T, 3, 3) of an STL file, in its unit.

    A binary file may begin with ``solid``: its length tells what it is.

    Raises:
        MeshError: if it is cut short, or has too many triangles.
    """
    count = int.from_bytes(data[80:_HEADER], "little")
    wanted = _HEADER + _RECORD.itemsize * count
    if len(data) < _HEADER or len(data) != wanted:
        text = data.removeprefix(b"\xef\xbb\xbf").lstrip()
        if text[:5].lower() == b"solid" and b"\0" not in text:
            return _read_text(text.lower())
        wanted = max(wanted, _HEADER)
        if len(data) < wanted:
            raise MeshError(
                f"a whole file (it is cut short: wants {wanted} bytes, has {len(data)}); {AGAIN}"
            )
        raise MeshError(f"{wanted} bytes for {count} triangles (it has {len(data)}); {AGAIN}")
    bounded(count, MOST_TRIANGLES, "triangles")
    points = np.frombuffer(data, _RECORD, offset=_HEADER)["corners"].astype(np.float64)
    return _finite(points)


def _read_text(text: bytes) -> Float[np.ndarray, "T 3 3"]:
    """Return the triangles of a text in lower case."""
    facets = text.count(b"endfacet")
    bounded(facets, MOST_TRIANGLES, "triangles")
    if text.rfind(b"endsolid") < max(text.rfind(b"endfacet"), 0):
        raise MeshError(
            f"a whole file (it is cut short: no endsolid after {facets} facets); {AGAIN}"
        )
    corners = _VERTEX.findall(text)
    if len(corners) != 3 * facets:
        raise MeshError(f"three corners in each facet (it has {len(corners)} in {facets}); {AGAIN}")
    values = numbers(b" ".join(corners), np.float64, "corners")
    if len(values) != 9 * facets:
        raise MeshError(f"corners of three numbers; {AGAIN}")
    return _finite(values.reshape(-1, 3, 3))


def _finite(points: Float[np.ndarray, "T 3 3"]) -> Float[np.ndarray, "T 3 3"]:
    return picked(points.reshape(-1, 3), np.arange(3 * len(points)).reshape(-1, 3))
