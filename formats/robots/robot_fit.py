"""Robot from a URDF's chain and meshes: capsules around every link, and mount axes where a ring can
be closed."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from jaxtyping import Bool, Float
from scipy.spatial import ConvexHull, QhullError

from ...coverage.choices import Surface
from ...coverage.robots.kinematics import Chain, arm_base, forward
from ...coverage.robots.robot import BASE, Body, Mount, Robot
from ...coverage.solids.capsules import Capsules
from .capsule_fit import fit_capsules, union_volume
from .meshes import Meshes
from .mount_detection import ROUND, MountTube, find_tube
from .urdf_folding import Picked
from .urdf_model import UrdfShape

CAPSULES = 3  # most capsules of a link
TOOL = "tool"  # the mount at the chain's tip
_FLANGE = 0.03  # m, distance from the tip within which the surface belongs to the flange
_POSES = 20_000  # random poses that estimate the reach and yield the default pose
_SOURCES = ("mesh", "collision mesh", "primitive shape")  # of a surface, the best first
_ROUND_MOST, _ROUND_LEAST = 0.9, 0.5  # shares of a stretch, for high and for medium confidence
_SMALL = 0.2  # m, extent of a link beside the chain below which it gets a single capsule
_SOURCE = 1000  # most characters of a robot's source
_NAME = 90  # most characters of a link's name in those of its mount and bodies
_ALIKE = 0.95  # cosine above which two directions count as equal


@dataclass(frozen=True)
class FittedLink:
    """A link and the capsules that contain it."""

    name: str
    """Name of the link."""
    frame: int
    """Index of its frame."""
    triangles: Float[np.ndarray, "T 3 3"]
    """Surface in its frame, m."""
    capsules: tuple[Capsules, ...]
    """Capsules that contain the surface."""
    volume: float
    """Volume of the capsules' union, m^3."""
    contained: float
    """Volume of the link, or of its convex hull if its surface is open, m^3."""

    @property
    def ratio(self) -> float:
        """Volume of the capsules relative to the link's."""
        return self.volume / self.contained if self.contained > 0 else np.inf


@dataclass(frozen=True)
class RobotFit:
    """A robot, and the fit of its links."""

    robot: Robot
    """The robot."""
    links: tuple[FittedLink, ...]
    """Links with their capsules."""
    notes: tuple[str, ...] = ()
    """Choices of the reader that a user should know, a sentence each."""


def _volume(triangles: Float[np.ndarray, "T 3 3"]) -> float:
    """Return the volume inside closed surfaces, m^3, or that of the convex hull of open ones; 0 for
    flat ones."""
    made = trimesh.Trimesh(**trimesh.triangles.to_kwargs(triangles), process=True)
    if made.is_watertight and made.volume > 0:
        return float(made.volume)
    try:
        return float(ConvexHull(triangles.reshape(-1, 3)).volume)
    except QhullError:
        return 0.0


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


def _zero(axis: Float[np.ndarray, " 3"]) -> Float[np.ndarray, " 3"]:
    """Return a unit vector perpendicular to ``axis``, close to the frame's x axis, or to y if
    ``axis`` is along x."""
    x, y, _ = np.eye(3)
    v = y if abs(float(axis @ x)) > 0.9 else x
    v = v - (v @ axis) * axis
    unit: np.ndarray = v / np.linalg.norm(v)
    return unit


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


def fit_robot(
    picked: Picked,
    meshes: Meshes,
    name: str,
    most: int = CAPSULES,
    which: Surface = "collision",
    tell: Callable[[str], None] | None = None,
) -> RobotFit:
    """Fit capsules to every link's surface, and find mount axes on the visual surfaces of the
    chain's own links.

    Links beside the chain (a gripper, a piston, another arm) are bodies only; small ones get one
    capsule each.

    Args:
        picked: the chain.
        meshes: its meshes.
        name: name of the robot.
        most: largest number of capsules of a link.
        which: surface that the capsules contain.
        tell: receives each link's name before its fit.

    Raises:
        UserError: for a mesh that is missing or cannot be read.
    """
    chain, links = picked.chain, []
    bodies: list[Body] = []
    seen: dict[int, list[Float[np.ndarray, "T 3 3"]]] = {}
    sources: dict[int, str] = {}
    names: dict[int, str] = {}
    surfaces = [meshes.surface(carried, which) for carried in picked.carried]  # refused early
    for carried, surface in zip(picked.carried, surfaces, strict=True):
        if not len(surface):
            continue
        if tell:
            tell(carried.link.name)
        small = carried.beside and float(np.ptp(surface.reshape(-1, 3), axis=0).max()) < _SMALL
        capsules = fit_capsules(surface, directions(chain, carried.frame), 1 if small else most)
        links.append(
            FittedLink(
                carried.link.name,
                carried.frame,
                surface,
                tuple(capsules),
                union_volume(capsules),
                _volume(surface),
            )
        )
        for i, c in enumerate(capsules):
            label = carried.link.name[:_NAME] + (f"_{i}" if len(capsules) > 1 else "")
            bodies.append(Body(label, carried.frame, c))
        if carried.beside:
            continue
        names.setdefault(carried.frame, carried.link.name[:_NAME])
        visual, collision = carried.link.visual, carried.link.collision
        source = _source(visual or collision, bool(visual))
        sources[carried.frame] = max(sources.get(carried.frame, source), source, key=_SOURCES.index)
        seen.setdefault(carried.frame, []).append(meshes.surface(carried, "visual"))
    mounts = [
        mount
        for frame in sorted(set(seen) - {BASE})
        if frame >= chain.first_revolute  # a rail's carriage is the arm's base: it has no ring
        and (
            mount := _mount(
                _own_name(names[frame]), chain, frame, np.concatenate(seen[frame]), sources[frame]
            )
        )
        is not None
    ]
    mounts.append(_tool(chain, np.concatenate(seen.get(len(chain) - 1, [np.zeros((0, 3, 3))]))))
    reach, home = _rest(chain, picked.limits)
    source = f"{picked.urdf.path.name}, {picked.base} to {picked.tip}"
    robot = Robot(
        name,
        chain,
        tuple(mounts),
        reach,
        tuple(bodies),
        picked.limits,
        home,
        source[:_SOURCE],
        picked.held,
    )
    return RobotFit(robot, tuple(links), (*picked.notes, *meshes.notes))


def _drawn(
    limits: Float[np.ndarray, "J 2"], slides: Bool[np.ndarray, " J"]
) -> Float[np.ndarray, "P J"]:
    """Return random poses (P, J) within the limits, with some joints at 0: angles in steps of 5
    degrees where the limits allow, and distances up to a metre in steps of a centimetre."""
    rng, shape, step = np.random.default_rng(0), (_POSES, len(limits)), np.radians(5)
    moved = rng.uniform(size=shape) < rng.uniform(0.1, 1, (_POSES, 1))
    turn = rng.uniform(-np.pi, np.pi, shape)
    value = moved * np.where(slides, np.round(turn / np.pi, 2), step * np.round(turn / step))
    poses: np.ndarray = np.clip(value, limits[:, 0], limits[:, 1])
    return poses


def _rest(chain: Chain, limits: Float[np.ndarray, "J 2"]) -> tuple[float, Float[np.ndarray, " J"]]:
    """Return an estimate of the reach, m, and a default pose (J,) rad or m.

    The reach is the largest distance of the last joint from the vertical axis through the arm's
    base in random poses, rounded up to the next centimetre. The pose is the random one that best
    holds the tip in front of the robot, at two thirds of its reach and below the elbow, with the
    whole arm above the ground and with few and small joint angles. A rail or lift that carries the
    arm stands as near to 0 as its limits allow.
    """
    first = chain.first_revolute
    q = np.tile(np.clip(0.0, limits[:, 0], limits[:, 1]), (_POSES, 1))
    q[:, first:] = _drawn(limits[first:], chain.slides[first:])
    q = chain.settled(q)
    points = np.asarray(forward(chain, q))[..., :3, 3]
    points = points[:, first:] - arm_base(chain, q[0])
    wrist, tip = points[:, -2], points[:, -1]
    far = max(float(np.linalg.norm(p, axis=1).max()) for p in (wrist[:, :2], 0.5 * tip))
    reach = math.ceil(100 * max(far, 0.01) - 1e-9) / 100
    off = np.linalg.norm(tip - np.array([0.65, 0, 0.3]) * reach, axis=1)
    low = np.maximum(-points[..., 2].min(axis=1), 0.0)
    elbow = np.abs(points[..., 2].max(axis=1) - tip[:, 2] - 0.3 * reach)
    turned = 0.05 * np.count_nonzero(q, axis=1) + 0.05 * np.abs(q).sum(axis=1)
    return reach, q[int(np.argmin(off + 3 * low + elbow + reach * turned))]


def outlines(links: Sequence[FittedLink]) -> str:
    """Return a line that states how tight the capsules are."""
    volume, contained = sum(link.volume for link in links), sum(link.contained for link in links)
    capsules = sum(len(link.capsules) for link in links)
    times = (
        f", {volume / contained:.2f} times their volume" if contained > 0 else ", which are flat"
    )
    return f"{capsules} capsules around {len(links)} links{times}"
