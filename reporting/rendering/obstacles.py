"""Obstacles of the cell in a picture: outlined, so that they hide neither robot nor target."""

from collections import defaultdict

import numpy as np
from jaxtyping import Float

from ...formats.export.palette import OBSTACLE
from ...objectives.scene import Scene
from .canvas import Canvas
from .colours import rgb
from .meshes import faces_within

_ALPHA = 0.1  # opacity of the faces
_WIDTH = 1.3  # points, width of the edges
_FLAT = 0.98  # least cosine of the angle between faces that make no edge
_NEAR = 0.3  # m; obstacles as near to what a picture shows are part of it


def with_obstacles(box: Float[np.ndarray, "2 3"], scene: Scene) -> Float[np.ndarray, "2 3"]:
    """Return a box (2, 3) m extended to the parts of obstacles that lie near it; a floor, which has
    no end, is drawn in the box as it is."""
    room = box + np.array([[-_NEAR], [_NEAR]])
    solid = [one.body for one in scene.obstacles if len(one.body.edges)]
    corners = np.vstack([box, *(faces_within(body, room).reshape(-1, 3) for body in solid)])
    return np.stack([corners.min(axis=0), corners.max(axis=0)])


def add_obstacles(canvas: Canvas, scene: Scene) -> None:
    """Add the obstacles within the canvas's box: their edges, and faces that let most through."""
    for one in scene.obstacles:
        faces = faces_within(one.body, canvas.box)
        canvas.faces(faces, OBSTACLE, _ALPHA)
        canvas.lines(sharp_edges(faces), 0.72 * rgb(OBSTACLE), _WIDTH)


def sharp_edges(faces: Float[np.ndarray, "N 3 3"]) -> Float[np.ndarray, "E 2 3"]:
    """Return the edges (E, 2, 3) m of a closed convex surface of triangles at which it bends."""
    sides: dict[tuple[bytes, bytes], list[int]] = defaultdict(list)
    ends: dict[tuple[bytes, bytes], np.ndarray] = {}
    middle = faces.reshape(-1, 3).mean(axis=0) if len(faces) else np.zeros(3)
    normal = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    normal *= np.where(((faces.mean(axis=1) - middle) * normal).sum(axis=1) < 0, -1, 1)[:, None]
    for i, corners in enumerate(np.round(faces, 7) + 0.0):
        for a, b in ((0, 1), (1, 2), (2, 0)):
            keys = corners[a].tobytes(), corners[b].tobytes()
            key = min(keys), max(keys)
            sides[key].append(i)
            ends[key] = corners[[a, b]]
    sharp = [ends[key] for key, two in sides.items() if (normal[two] @ normal[two].T).min() < _FLAT]
    return np.array(sharp).reshape(-1, 2, 3)
