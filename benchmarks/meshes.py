"""Polygon meshes of cones, and their union inside a ball, for peers that need meshes."""

import math

import numpy as np
from place_rings.coverage.solids.cones import Cones


def _frame(axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    across = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    across /= np.linalg.norm(across)
    return across, np.cross(axis, across)


def mesh_share(
    cones: Cones, sides: int, round_sides: int, ball: float, outside: bool = False
) -> float:
    """Return the volume of the union of cone meshes inside a ball's mesh, relative to 4/3 pi r^3.

    manifold3d computes it. The meshes lie inside the true solids, or around them if ``outside`` is
    set: polygons enlarged by 1 / cos(pi / sides), and the ball's mesh scaled until its nearest face
    touches the ball.
    """
    from manifold3d import Manifold, OpType

    grow = 1 / math.cos(math.pi / sides) if outside else 1.0
    each = []
    for apex, axis, half, height in zip(
        cones.apex, cones.axis, cones.half_angle, cones.range_m, strict=True
    ):
        u, v = _frame(axis)
        cylinder = Manifold.cylinder(height, 0.0, height * math.tan(half) * grow, sides)
        each.append(cylinder.transform(np.column_stack([u, v, axis, apex])))
    round_ = Manifold.sphere(ball, round_sides)
    if outside:
        mesh = round_.to_mesh()
        corners = np.asarray(mesh.vert_properties, float)[:, :3][np.asarray(mesh.tri_verts)]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        nearest = ((corners[:, 0] * normal).sum(axis=1) / np.linalg.norm(normal, axis=1)).min()
        round_ = round_.scale([ball / float(nearest)] * 3)
    union = Manifold.batch_boolean(each, OpType.Add) ^ round_
    return float(union.volume() / (4 / 3 * math.pi * ball**3))
