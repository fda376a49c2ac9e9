"""Reader of the surfaces in Wavefront OBJ meshes."""

import re

import numpy as np
from jaxtyping import Float

from .mesh_numbers import AGAIN, MOST_TRIANGLES, MeshError, bounded, fans, numbers, picked

_POINT = re.compile(rb"^v ([^ \n#]+ [^ \n#]+ [^ \n#]+)", re.MULTILINE)
_FACE = re.compile(rb"^f ([^\n#]*)", re.MULTILINE)
_REST = re.compile(rb"/[^ ]*")  # numbers of texture and normal after that of a point


def read_obj(data: bytes) -> Float[np.ndarray, "T 3 3"]:
    """Return the triangles (T, 3, 3) of an OBJ file, in its unit; polygons become fans.

    Raises:
        MeshError: if a line is damaged, or it has too many triangles.
    """
    text = _plain(data)
    bounded(count := text.count(b"\nv "), 3 * MOST_TRIANGLES, "points")
    bounded(text.count(b"\nf "), MOST_TRIANGLES, "triangles")
    coordinates = _POINT.findall(text)
    if len(coordinates) != count:
        raise MeshError(f"points of three numbers ({len(coordinates)} of {count} are); {AGAIN}")
    points = numbers(b" ".join(coordinates), np.float64, "points").reshape(-1, 3)
    faces = _FACE.findall(text)
    corners = np.fromiter((face.strip().count(b" ") + 1 for face in faces), np.int64, len(faces))
    triangles = fans(corners)
    number = numbers(_REST.sub(b"", b" ".join(faces)), np.int64, "faces")
    if len(number) != corners.sum():
        raise MeshError(f"faces of whole numbers; {AGAIN}")
    if (number == 0).any():
        raise MeshError(f"faces whose points count from 1 (one is 0); {AGAIN}")
    if (number < 0).any():  # they count back from the point before the face
        place = [match.start() for match in _POINT.finditer(text)]
        before = np.searchsorted(place, [match.start() for match in _FACE.finditer(text)])
        number = np.where(number < 0, np.repeat(before, corners) + number + 1, number)
    return picked(points, number[triangles] - 1)


def _plain(data: bytes) -> bytes:
    """Return a text with single blanks, and none at the start of a line."""
    text = b"\n" + data.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n")
    for old, new in ((b"\r", b"\n"), (b"\\\n", b" "), (b"\t", b" ")):
        text = text.replace(old, new)
    if b"  " in text:
        text = re.sub(rb" {2,}", b" ", text)
    return text.replace(b"\n ", b"\n")
