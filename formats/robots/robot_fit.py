"""Robot from a URDF's chain and meshes: capsules around every link, and mount axes where a ring can
be closed."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from jaxtyping import Bool, Float
from scipy.spatial import ConvexHull, QhullError

from ...coverage.choices import Surface
from ...coverage.definitions.errors import shown
from ...coverage.robots.kinematics import Chain, arm_base, forward
from ...coverage.robots.robot import Body, Robot
from ...coverage.solids.capsules import Capsules
from .capsule_fit import fit_capsules, union_volume
from .meshes import Meshes
from .mount_axes import LONGEST_LINK, directions, mounts_of
from .urdf_folding import Carried, Picked
from .xml_text import some

CAPSULES = 3  # most capsules of a link
_SMALL = 0.2  # m, extent of a link beside the chain below which it gets a single capsule
_SOURCE = 1000  # most characters of a robot's source
_OUTSIDE = 0.005  # m, depth of a visual surface outside its body from which it is named
_POSES = 20_000  # random poses that estimate the reach and yield the default pose
_SAMPLES = 4000  # most corners of a visual surface that are compared with its body


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
    surfaces = [meshes.surface(carried, which) for carried in picked.carried]  # refused early
    whole = [(c, s) for c, s in zip(picked.carried, surfaces, strict=True) if len(s)]
    links, bodies = [], list[Body]()
    for carried, surface in whole:
        if tell:
            tell(carried.link.name)
        link = _fitted(picked.chain, carried, surface, most)
        links.append(link)
        for i, c in enumerate(link.capsules):
            label = link.name[:LONGEST_LINK] + (f"_{i}" if len(link.capsules) > 1 else "")
            bodies.append(Body(label, link.frame, c))
    own = [carried for carried, _ in whole if not carried.beside]
    outside = {
        carried.link.name: _outside(link, meshes.kind(carried, "visual"))
        for (carried, _), link in zip(whole, links, strict=True)
        if which == "collision" and not carried.beside and carried.link.collision
    }
    mounts = mounts_of(picked.chain, own, meshes)
    reach, home = reach_and_pose(picked.chain, picked.limits)
    source = f"{picked.urdf.path.name}, {picked.base} to {picked.tip}"
    robot = Robot(
        name,
        picked.chain,
        mounts,
        reach,
        tuple(bodies),
        picked.limits,
        home,
        source[:_SOURCE],
        picked.held,
    )
    notes = (*picked.notes, *meshes.notes, *_outside_note(outside))
    return RobotFit(robot, tuple(links), notes)


def _outside(link: FittedLink, visual: Float[np.ndarray, "T 3 3"]) -> float:
    """Return the largest distance, m, of a visual surface's corners from the link's capsules; of
    many corners a sample counts, with the extreme ones along the axes."""
    points = visual.reshape(-1, 3)
    if not len(points):
        return 0.0
    extreme = points[np.concatenate([points.argmin(axis=0), points.argmax(axis=0)])]
    sample = np.concatenate([points[:: 1 + len(points) // _SAMPLES], extreme])
    return float(np.min([c.distance(sample) for c in link.capsules], axis=0).max())


def _outside_note(outside: dict[str, float]) -> list[str]:
    """Return a sentence about the links whose visual surface lies outside their bodies, if any."""
    far = [
        f"{shown(link)} by {1000 * depth:.0f} mm"
        for link, depth in sorted(outside.items(), key=lambda item: -item[1])
        if depth > _OUTSIDE
    ]
    if not far:
        return []
    return [
        f"Bodies are fitted to the collision shapes, and visual surfaces lie outside: {some(far)};"
        " place-rings robot --surface visual fits these."
    ]


def _fitted(
    chain: Chain, carried: Carried, surface: Float[np.ndarray, "T 3 3"], most: int
) -> FittedLink:
    """Return a link with at most ``most`` capsules around its surface, or one if it is small and
    beside the chain."""
    small = carried.beside and float(np.ptp(surface.reshape(-1, 3), axis=0).max()) < _SMALL
    capsules = fit_capsules(surface, directions(chain, carried.frame), 1 if small else most)
    return FittedLink(
        carried.link.name,
        carried.frame,
        surface,
        tuple(capsules),
        union_volume(capsules),
        _volume(surface),
    )


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


def outlines(links: Sequence[FittedLink]) -> str:
    """Return a line that states how tight the capsules are."""
    volume, contained = sum(link.volume for link in links), sum(link.contained for link in links)
    capsules = sum(len(link.capsules) for link in links)
    times = (
        f", {volume / contained:.2f} times their volume" if contained > 0 else ", which are flat"
    )
    return f"{capsules} capsules around {len(links)} links{times}"


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


def reach_and_pose(
    chain: Chain, limits: Float[np.ndarray, "J 2"]
) -> tuple[float, Float[np.ndarray, " J"]]:
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
