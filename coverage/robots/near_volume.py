"""V_N, the near volume: the points within a distance r of the robot's bodies, less the bodies.

The bodies are the capsules of the links, the base's among them, and what is attached to the robot;
mounted rings are not. A capsule grows to a capsule. A convex polyhedron, grown by r, consists of
itself, a capsule of radius r about each edge, and a plate on each face: the prism over the face, up
to r beyond it. Each plate also reaches r into the polyhedron. Whatever of it leaves the polyhedron
on another side is within r of the face, so the plate stays inside the grown polyhedron; and no
surface of the solid coincides with the face, from which bounds of cubes there would suffer. What no
plate reaches, deep in the polyhedron, is missing from the solid but belongs to the robot anyway.

All this is a union of convex parts with 1-Lipschitz functions, so the minimum is 1-Lipschitz too,
and the zero set is exact. The capsules' curvature is at most the reciprocal of the distance from
the axis (``Capsules``); plates are flat (``Polyhedra``).
"""

from dataclasses import dataclass
from functools import reduce

import numpy as np

from ..pytrees import tree
from ..solids.base import Solid, Union
from ..solids.capsules import Capsules
from ..solids.polyhedra import Polyhedra, Polyhedron, polyhedra


@tree
@dataclass(frozen=True)
class GrownPolyhedron(Union):
    """The points within a distance of a convex polyhedron, but for those deep inside it."""

    a: Capsules
    """Capsules about its edges."""
    b: Polyhedra
    """Plates on its faces."""


def near(bodies: Capsules, carried: tuple[Polyhedron, ...], radius: float) -> Solid:
    """Return the points within ``radius`` m of bodies in the base frame, and most of the bodies.

    Args:
        bodies: the robot's capsules.
        carried: the polyhedra that it carries.
        radius: the distance, m.
    """
    grown: Solid = Capsules(bodies.start, bodies.end, bodies.radius + radius)
    return reduce(Union, (_grown(body, radius) for body in carried), grown)


def _grown(body: Polyhedron, radius: float) -> GrownPolyhedron:
    edges = np.asarray(body.edges)
    rims = Capsules(edges[:, 0], edges[:, 1], np.full(len(edges), radius))
    return GrownPolyhedron(rims, polyhedra(_plates(body, radius), rims.bounds()))


def _plates(body: Polyhedron, radius: float) -> tuple[Polyhedron, ...]:
    """Return the prism over each face of a polyhedron, ``radius`` m to both sides of it."""
    none, plates = (np.zeros((0, 2, 3)), np.zeros((0, 2), int)), []
    for face, (n, offset) in enumerate(zip(body.normal, body.offset, strict=True)):
        ends = np.asarray(body.edges)[(np.asarray(body.faces) == face).any(axis=1)]
        along = ends[:, 1] - ends[:, 0]
        side = np.cross(along / np.linalg.norm(along, axis=1, keepdims=True), n)
        side *= np.sign(((ends[:, 0] - ends.mean(axis=(0, 1))) * side).sum(axis=1))[:, None]
        normal = np.concatenate([[n, -n], side])
        where = np.concatenate(
            [[offset + radius, radius - offset], (side * ends[:, 0]).sum(axis=1)]
        )
        plates.append(Polyhedron(normal, where, *none))
    return tuple(plates)
