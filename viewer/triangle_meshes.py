"""Triangle meshes of bodies, sensors and beams, and edges of outlines."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ..coverage.arrays import Array
from ..coverage.cube_region import CubeRegion
from ..coverage.definitions.errors import UserError, shown
from ..coverage.robots.kinematics import Chain, forward
from ..coverage.robots.link_bodies import robot_capsules
from ..coverage.robots.near_volume import GrownPolyhedron
from ..coverage.robots.robot import BASE, Robot
from ..coverage.solids.base import Difference, Intersection, Solid, Union
from ..coverage.solids.beams import Beams
from ..coverage.solids.capsules import Capsules
from ..coverage.solids.frustums import Frustums
from ..coverage.solids.polyhedra import Polyhedra, half_space, polyhedra
from ..coverage.solids.spheres import Spheres
from ..coverage.solids.swept_tube import Tube
from ..formats.robots.urdf_matching import chain_between
from ..formats.robots.urdf_options import UrdfOptions
from ..reporting.rendering.meshes import (
    DISC,
    body,
    capsule_surfaces,
    circle,
    joined,
    loops,
    polyhedra_edges,
    rim_of,
    rod,
    tube,
)
from ..reporting.rendering.surface import Surface

_STICK = 0.045  # m, radius of the stick for a robot without bodies
# m, half the edges of a sensor: two across, one along its axis
_CHIP = np.array([0.011, 0.011, 0.005])
_EVERY = 0.15  # m, distance between the circles of an outline
_MOST_EDGES = 60  # of a grown polyhedron that is outlined
_INSIDE = 0.01  # m below a surface, beyond the rounding of circles by chords
_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
_SIDES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
_BOX = np.array([f for a, b, c, d in _SIDES for f in ((a, b, c), (a, c, d))])


def bodies(robot: Robot, frames: Float[Array, "F 4 4"]) -> Surface:
    """Return the robot's capsules; without bodies, rods along its joints and mounts."""
    if not robot.bodies:
        return joined([tube(rod(a, b, _STICK)) for a, b in pairwise(body(robot, frames))])
    return joined(capsule_surfaces(robot_capsules(robot, frames), tube))


def chips(cones: Beams) -> Surface:
    """Return the sensors as small boxes along their axes."""
    found = []
    for apex, axis in zip(np.asarray(cones.apex), np.asarray(cones.axis), strict=True):
        across = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
        across /= np.linalg.norm(across)
        turn = np.stack([across, np.cross(axis, across), axis])
        found.append((apex + (_CORNERS * _CHIP) @ turn, _BOX))
    return joined(found)


def beams(
    cones: Beams, lengths: Float[np.ndarray, " K"], some: Sequence[int] | None = None
) -> tuple[Surface, Float[np.ndarray, "E 2 3"]]:
    """Return the beams, open at their ends, and the edges of those ends.

    Args:
        cones: beams.
        lengths: length (K,) m of each beam.
        some: indices of the beams to return; None: all.

    Returns:
        The surface, and edges (E, 2, 3) m.
    """
    found, edges = [], []
    for k in range(len(lengths)) if some is None else some:
        rim = rim_of(cones, k, float(lengths[k]))
        rim = rim[:: 2 if len(rim) > 8 else 1]
        n = len(rim)
        faces = np.stack([np.zeros(n, int), 1 + np.arange(n), 1 + (np.arange(n) + 1) % n], axis=1)
        found.append((np.vstack([cones.apex[k], rim]), faces))
        edges.append(np.stack([rim, np.roll(rim, -1, axis=0)], axis=1))
    return joined(found), np.concatenate(edges) if edges else np.zeros((0, 2, 3))


def grid(half: float, step: float) -> Float[np.ndarray, "E 2 3"]:
    """Return the edges of a square grid in the base plane, ``half`` m to each side, one line
    per ``step`` m.
    """
    at = np.arange(-half, half + step / 2, step)
    along = np.array([[[x, -half, 0.0], [x, half, 0.0]] for x in at])
    return np.concatenate([along, along[..., [1, 0, 2]]])


def outline(outer: Solid) -> Float[np.ndarray, "E 2 3"]:
    """Return edges (E, 2, 3) m that outline a target's outer solid: circles on balls and around
    tubes, cylinders and cones, two half circles on each end of a capsule, and the edges of
    polyhedra; of other solids, those of their box. What lies inside a union or among capsules
    is left out.
    """
    if isinstance(outer, GrownPolyhedron):
        rims = outline(outer.a) if len(outer.a) <= _MOST_EDGES else np.zeros((0, 2, 3))
        return _on_surface(outer, rims)
    if isinstance(outer, Union | Intersection | Difference):
        edges = np.concatenate([outline(outer.a), outline(outer.b)])
        return _on_surface(outer, edges) if isinstance(outer, Union) else edges
    if isinstance(outer, CubeRegion):
        return np.zeros((0, 2, 3))
    if isinstance(outer, Polyhedra):
        return polyhedra_edges(outer)
    if isinstance(outer, Frustums):
        return np.concatenate([_frustum(outer, k) for k in range(len(outer))])
    if isinstance(outer, Spheres):
        each = [
            (c, axis, float(r))
            for c, r in zip(outer.centre, outer.radius, strict=True)
            for axis in np.eye(3)
        ]
    elif isinstance(outer, Capsules):
        return _on_surface(outer, np.concatenate([_capsule(outer, k) for k in range(len(outer))]))
    elif isinstance(outer, Tube):
        each = list(_around(outer))
    else:
        return polyhedra_edges(
            polyhedra((half_space(float(outer.bounds()[1, 2])),), outer.bounds())
        )
    return loops(np.array([circle(np.asarray(c), np.asarray(axis), r) for c, axis, r in each]))


def _on_surface(solid: Solid, edges: Float[np.ndarray, "E 2 3"]) -> Float[np.ndarray, "F 2 3"]:
    """Return the edges (F, 2, 3) m whose middle is not inside the solid."""
    return edges[np.asarray(solid(edges.mean(axis=1))) > -_INSIDE]


def _capsule(capsules: Capsules, k: int) -> Float[np.ndarray, "E 2 3"]:
    """Return two circles across the axis of a capsule and two around both its ends."""
    start, end = np.asarray(capsules.start)[k], np.asarray(capsules.end)[k]
    radius, axis = float(capsules.radius[k]), end - start
    length = float(np.linalg.norm(axis))
    axis = axis / length if length > 1e-6 else np.array([0.0, 0.0, 1.0])
    rims = [circle(p, axis, radius) for p in (start, end)]
    for way in (rims[0][0] - start, rims[0][len(rims[0]) // 4] - start):
        hoop = circle((start + end) / 2, np.cross(axis, way / radius), radius)
        rims.append(hoop + np.sign((hoop - (start + end) / 2) @ axis)[:, None] * axis * length / 2)
    return loops(np.array(rims))


def _frustum(frustums: Frustums, k: int) -> Float[np.ndarray, "E 2 3"]:
    """Return the two rims of a frustum of a cone and four lines between them."""
    rims = frustums.surface(k, len(DISC))[0].reshape(2, len(DISC), 3)
    sides = rims[:, :: rims.shape[1] // 4].transpose(1, 0, 2)
    return np.concatenate([loops(rims), sides])


def _around(tube: Tube) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """Return circles around a tube at even steps, including its ends."""
    centre, normal, found = np.asarray(tube.centre), np.asarray(tube.normal), []
    travelled = 0.0
    for i in range(len(centre)):
        if i:
            step = float(np.linalg.norm(centre[i] - centre[i - 1]))
            for t in np.arange(_EVERY - travelled, step, _EVERY):
                v = (1 - t / step) * normal[i - 1] + t / step * normal[i]
                found.append(
                    (
                        centre[i - 1] + t / step * (centre[i] - centre[i - 1]),
                        v / np.linalg.norm(v),
                        tube.radius,
                    )
                )
            travelled = (travelled + step) % _EVERY
        if i in (0, len(centre) - 1):
            found.append((centre[i], normal[i], tube.radius))
    return found


_SAME = 0.005  # m, largest distance between joints of equal chains
_POSES = 8  # random poses at which chains are compared


@dataclass(frozen=True)
class Skin:
    """Triangles (T, 3, 3) m of a robot's links, each in a frame of its chain."""

    chain: Chain
    links: tuple[tuple[int, Float[np.ndarray, "_ 3 3"]], ...]

    def at(self, q: Float[np.ndarray, " J"]) -> Surface:
        """Return the surface at joint angles ``q`` (J,) rad, base frame."""
        frames, found = forward(self.chain, q), []
        for frame, triangles in self.links:
            T = np.eye(4) if frame == BASE else frames[frame]
            found.append((triangles @ T[:3, :3].T + T[:3, 3]).reshape(-1, 3))
        vertices = np.concatenate(found) if found else np.zeros((0, 3))
        return vertices, np.arange(len(vertices)).reshape(-1, 3)


def read_skin(source: str | Path, reading: UrdfOptions, robot: Robot) -> Skin:
    """Read the visual meshes of a robot's description.

    Args:
        source: URDF, xacro or MJCF file, or a name of robot_descriptions.
        reading: the folders of meshes; and the chain, unless the URDF has joints with the names of
            the robot's.
        robot: robot whose joints must equal those of the URDF.

    Raises:
        UserError: for an invalid URDF or mesh, or if the joints differ from those of ``robot``.
    """
    path, reading = reading.located(source)
    urdf = reading.read(path)
    joints = robot.chain.joints
    named = all(name in urdf.joints for name in joints)
    picked = chain_between(urdf, joints[0], joints[-1], robot) if named else reading.pick(urdf)
    wanted = f"a URDF with the joints of robot {shown(robot.name)}"
    if len(picked.chain) != len(robot.chain):
        raise UserError(
            f"--urdf: found {len(picked.chain)} joints in {path}, allowed: {wanted},"
            f" {len(robot.chain)}"
        )
    chain, T_base = picked.chain, np.eye(4)
    if named:  # base and TCP are the robot's, which may begin and end elsewhere
        T_base = robot.chain.origin[0] @ np.linalg.inv(chain.origin[0])
        ends = robot.chain.origin[[0, -1]]
        chain = replace(chain, origin=np.stack([ends[0], *chain.origin[1:-1], ends[1]]))
    for q in (robot.rest, *np.random.default_rng(0).uniform(-1, 1, (_POSES, len(robot.chain)))):
        off = (forward(chain, q) - forward(robot.chain, q))[:, :3, 3]
        if (worst := float(np.abs(off).max())) > _SAME:
            raise UserError(
                f"--urdf: found joints of {path} off by up to {worst:.3g} m, allowed: {wanted}"
            )
    meshes = reading.meshes(urdf)
    links = ((carried.frame, meshes.surface(carried, "visual")) for carried in picked.carried)
    found = tuple(
        (frame, triangles @ T_base[:3, :3].T + T_base[:3, 3] if frame == BASE else triangles)
        for frame, triangles in links
        if len(triangles)
    )
    if not found:
        raise UserError(f"--urdf: found no shape in {path}, allowed: links with meshes or shapes")
    return Skin(chain, found)
