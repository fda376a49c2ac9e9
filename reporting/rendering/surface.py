"""Surfaces made of triangles, and their normals for shading."""

import numpy as np
from jaxtyping import Float, Int

Surface = tuple[Float[np.ndarray, "_ 3"], Int[np.ndarray, "_ 3"]]
"""A mesh: vertices (V, 3) m, and the vertex indices (T, 3) of its triangles."""


def vertex_normals(
    vertices: Float[np.ndarray, "V 3"], triangles: Int[np.ndarray, "T 3"]
) -> Float[np.ndarray, "V 3"]:
    """Return unit vertex normals (V, 3) of a mesh; 0 where there is none.

    Each is the mean over adjacent triangles weighted by their angles, so it does not depend on how
    a flat face is triangulated.
    """
    corners = vertices[triangles]
    way = np.roll(corners, -1, axis=1) - corners  # (T, 3, 3), to the next corner
    way /= np.maximum(np.linalg.norm(way, axis=2, keepdims=True), 1e-300)
    angle = np.arccos(np.clip(-np.sum(way * np.roll(way, 1, axis=1), axis=2), -1, 1))
    flat = np.cross(way[:, 0], way[:, 1])
    flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-300)
    of_corner = (angle[..., None] * flat[:, None]).reshape(-1, 3)
    normal = np.stack(
        [np.bincount(triangles.ravel(), of_corner[:, i], len(vertices)) for i in range(3)], axis=1
    )
    unit: np.ndarray = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    return unit
