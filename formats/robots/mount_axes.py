"""Mounts of a robot from a URDF: about the tubes of its links, and at the tip."""

from collections.abc import Iterable, Sequence

import numpy as np
from jaxtyping import Float

from ...coverage.robots.kinematics import Chain
from ...coverage.robots.robot import BASE, Mount
from .meshes import Meshes
from .mount_detection import ROUND, MountTube, find_tube
from .urdf_folding import Carried
from .urdf_model import UrdfShape

TOOL = "tool"  # the mount at the chain's tip
LONGEST_LINK = 90  # most characters of a link's name in those of its mount and bodies
_FLANGE = 0.03  # m, distance from the tip within which the surface belongs to the flange
_SOURCES = ("mesh", "collision mesh", "primitive shape")  # of a surface, the best first
_ROUND_MOST, _ROUND_LEAST = 0.9, 0.5  # shares of a stretch, for high and for medium confidence
_ALIKE = 0.95  # cosine above which two directions count as equal


def directions(chain: Chain, frame: int) -> list[Float[np.ndarray, " 3"]]:
    """Return unit vectors (3,) in a frame of the chain along which its link may extend.

    They are the direction of the next joint, the axes of its own and the next joint, and the
    frame's axes.
    """
    units: list[Float[np.ndarray, " 3"]] = []
    options = [chain.origin[frame + 1][:3, 3]] if frame + 1 < len(chain.origin) else []
    if 0 <= frame < len(chain):
        options.append(chain.axis[frame])
    if frame + 1 < len(chain):
        options.append(chain.origin[frame + 1][:3, :3] @ chain.axis[frame + 1])
    for v in [*options, *np.eye(3)]:
        length = float(np.linalg.norm(v))
        if length > 1e-3 and all(abs(float(v @ other)) < _ALIKE * length for other in units):
            units.append(v / length)
    return units


def mounts_of(chain: Chain, own: Sequence[Carried], meshes: Meshes) -> tuple[Mount, ...]:
    """Return the mounts about the visual surfaces of the chain's own links, and that at the tip.

    Args:
        chain: the chain.
        own: the chain's own links that have a surface.
        meshes: their meshes.

    Raises:
        UserError: for a mesh that is missing or cannot be read.
    """
    seen: dict[int, list[Float[np.ndarray, "T 3 3"]]] = {}
    sources: dict[int, str] = {}
    names: dict[int, str] = {}
    for carried in own:
        frame, (kind, triangles) = carried.frame, meshes.used_surface(carried, "visual")
        names.setdefault(frame, carried.link.name[:LONGEST_LINK])
        source = _source(carried.link.shapes(kind), kind == "visual")
        sources[frame] = max(sources.get(frame, source), source, key=_SOURCES.index)
        seen.setdefault(frame, []).append(triangles)
    mounts = [
        _mount(_own_name(names[frame]), chain, frame, np.concatenate(seen[frame]), sources[frame])
        for frame in sorted(set(seen) - {BASE})
        if frame >= chain.first_revolute  # a rail's carriage is the arm's base: it has no ring
    ]
    flange = np.concatenate(seen.get(len(chain) - 1, [np.zeros((0, 3, 3))]))
    return (*(mount for mount in mounts if mount is not None), _tool(chain, flange))


def confidence(tube: MountTube, source: str) -> tuple[str, str]:
    """Return the confidence of a mount, high, medium or low, and its reason.

    Args:
        tube: the tube of the mount.
        source: kind of its surface: ``mesh``, ``collision mesh`` or ``primitive shape``.
    """
    share = f"round within {100 * ROUND:.0f} % on {100 * tube.round:.0f} % of the stretch"
    if tube.round < _ROUND_LEAST:
        return "low", f"{source}, {share}: a ring does not close tightly around the rest"
    if source != _SOURCES[0]:
        return "medium", f"{source} instead of a visual mesh, {share}"
    return ("high" if tube.round >= _ROUND_MOST else "medium"), f"{source}, {share}"


def _source(shapes: Iterable[UrdfShape], visual: bool) -> str:
    if any(shape.kind != "mesh" for shape in shapes):
        return _SOURCES[2]
    return _SOURCES[0 if visual else 1]


def _mount(
    name: str, chain: Chain, frame: int, triangles: Float[np.ndarray, "T 3 3"], source: str
) -> Mount | None:
    """Return the mount about the tube of a link, from proximal to distal; None without a tube."""
    towards = chain.origin[frame + 1][:3, 3]
    # the next joint coincides with this one: use the direction away from the previous one
    if np.linalg.norm(towards) < 1e-6:
        before, axis = np.linalg.inv(chain.origin[frame])[:3, 3], chain.axis[frame]
        towards = -(before @ axis) * axis
    spread = triangles.reshape(-1, 3)
    principal = np.linalg.svd(spread - spread.mean(axis=0), full_matrices=False)[2]
    tube = find_tube(triangles, [*directions(chain, frame), *principal])
    if tube is None:
        return None
    start, end = tube.start, tube.end
    if float((end - start) @ towards) < 0:
        start, end = end, start
    axis = (end - start) / tube.length
    return Mount(
        name,
        frame,
        start,
        axis,
        _zero(axis),
        tube.length,
        (0.0, 1.0),
        tube.radius,
        *confidence(tube, source),
    )


def _tool(chain: Chain, triangles: Float[np.ndarray, "T 3 3"]) -> Mount:
    """Return the mount at the tip, with a fixed position.

    Its axis points outwards along the last joint's axis if the tip lies along that axis, else along
    the line to the tip.
    """
    T, out, axis = np.linalg.inv(chain.origin[-1]), chain.origin[-1][:3, 3], chain.axis[-1]
    along, far = float(out @ axis), float(np.linalg.norm(out))
    axis = T[:3, :3] @ (
        np.copysign(1.0, along + 1e-9) * axis if abs(along) >= 0.5 * far else out / far
    )
    points = triangles.reshape(-1, 3) @ T[:3, :3].T + T[:3, 3]
    points = points[np.abs(points @ axis) < _FLANGE]
    away = np.linalg.norm(points - (points @ axis)[:, None] * axis, axis=1)
    return Mount(
        TOOL,
        len(chain),
        np.zeros(3),
        axis,
        _zero(axis),
        0.0,
        (0.0, 1.0),
        float(away.max(initial=0.0)),
        "low",
        f"largest radius within {1000 * _FLANGE:.0f} mm of the tip"
        if len(away)
        else "no surface near the tip",
    )


def _own_name(link: str) -> str:
    """Return the name of a link's mount: the link's, unless the mount at the tip has it."""
    return f"{link}_link" if link == TOOL else link


def _zero(axis: Float[np.ndarray, " 3"]) -> Float[np.ndarray, " 3"]:
    """Return a unit vector perpendicular to ``axis``, close to the frame's x axis, or to y if
    ``axis`` is along x."""
    x, y, _ = np.eye(3)
    v = y if abs(float(axis @ x)) > 0.9 else x
    v = v - (v @ axis) * axis
    unit: np.ndarray = v / np.linalg.norm(v)
    return unit
