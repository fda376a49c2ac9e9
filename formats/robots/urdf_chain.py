"""Serial chain in a URDF: from a base link to a tip, with fixed joints folded, and the links that
move with each frame."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...coverage.robots.kinematics import Chain
from ...coverage.robots.robot import BASE
from ..errors import UserError, shown
from .urdf import Joint, Urdf, UrdfLink

MOST_JOINTS = 20
_SHORTEST = 1e-3  # m, least length of a chain
_SHOWN = 8  # most names in a message

Transform = Float[np.ndarray, "4 4"]


@dataclass(frozen=True)
class Carried:
    """A link that moves with a frame of the chain."""

    link: UrdfLink
    """The link."""
    frame: int
    """Index of the frame; ``BASE`` if it does not move."""
    T_frame_link: Transform
    """Pose of the link."""


@dataclass(frozen=True)
class Picked:
    """A chain from a URDF."""

    urdf: Urdf
    """The file."""
    base: str
    """Name of the base link."""
    tip: str
    """Name of the last link."""
    chain: Chain
    """The chain."""
    limits: Float[np.ndarray, "J 2"]
    """Joint limits, rad or m."""
    carried: tuple[Carried, ...]
    """All links that move with the chain."""
    left_out: tuple[str, ...]
    """Names of links that are ignored because joints outside the chain move them."""


def _some(names: list[str]) -> str:
    return ", ".join(names[:_SHOWN]) + f" and {len(names) - _SHOWN} more" * (len(names) > _SHOWN)


def _tree(urdf: Urdf) -> tuple[dict[str, Joint], list[str]]:
    """Return the parent joint of each link, and the root links.

    Raises:
        UserError: if the links do not form a tree.
    """
    above: dict[str, Joint] = {}
    for joint in urdf.joints.values():
        if joint.child in above:
            raise UserError(
                f"{urdf.path}: joint {shown(joint.name)}: child: found {shown(joint.child)}, which"
                f" joint {shown(above[joint.child].name)} carries already; allowed: one parent"
                " joint for each link"
            )
        above[joint.child] = joint
    for name in urdf.links:
        seen, at = {name}, name
        while at in above:
            at = above[at].parent
            if at in seen:
                raise UserError(
                    f"{urdf.path}: link {shown(at)}: found a loop of joints through it, allowed: a"
                    " tree"
                )
            seen.add(at)
    return above, [name for name in urdf.links if name not in above]


def _path(urdf: Urdf, above: dict[str, Joint], base: str, tip: str) -> list[Joint]:
    """Return the joints from base to tip.

    Raises:
        UserError: if no joints lead there.
    """
    path, at = [], tip
    while at != base:
        if at not in above:
            raise UserError(
                f"{urdf.path}: --tip: found {shown(tip)}, allowed: a link that joints connect to"
                f" {base}"
            )
        path.append(above[at])
        at = above[at].parent
    return path[::-1]


def _tip(urdf: Urdf, above: dict[str, Joint], base: str) -> str:
    """Return the only leaf behind the largest number of moving joints and, among those, of all
    joints."""
    parents = {j.parent for j in urdf.joints.values()}
    leaves: dict[str, tuple[int, int]] = {}
    for name in urdf.links:
        at, moving, joints = name, 0, 0
        while at != base and at in above:
            moving, joints, at = moving + above[at].moves, joints + 1, above[at].parent
        if at == base and name not in parents and name != base:
            leaves[name] = (moving, joints)
    if not leaves:
        raise UserError(
            f"{urdf.path}: link {shown(base)} has no joints; the base (--base) needs a chain of"
            " joints"
        )
    longest = [name for name, length in leaves.items() if length == max(leaves.values())]
    if len(longest) > 1:
        raise UserError(
            f"{urdf.path}: several chains are equally long; choose one with --tip: {_some(longest)}"
        )
    return longest[0]


def pick_chain(urdf: Urdf, base: str | None = None, tip: str | None = None) -> Picked:
    """Return the chain from ``base`` (by default the root) to ``tip`` (by default the end of the
    longest chain).

    Raises:
        UserError: if links form a loop, a name is unknown or ambiguous, or the chain has no length
            or a joint that is planar or floating, or mimics another.
    """
    above, roots = _tree(urdf)
    base, tip = _ends(urdf, above, roots, base, tip)
    path = _path(urdf, above, base, tip)
    moving = _moving(urdf, path, base, tip)
    rides, origin = _folded(path, base)
    if sum(float(np.linalg.norm(M[:3, 3])) for M in origin) < _SHORTEST:
        raise UserError(
            f"{urdf.path}: found a chain without length from {base} to {tip}, allowed:"
            f" at least {_SHORTEST:g} m"
        )
    left_out = _carry_branches(urdf, rides)
    return Picked(
        urdf,
        base,
        tip,
        Chain(
            tuple(j.name for j in moving),
            np.stack(origin),
            np.stack([j.axis for j in moving]),
            tuple(i for i, j in enumerate(moving) if j.kind == "prismatic"),
        ),
        np.array([j.limits for j in moving]),
        tuple(Carried(urdf.links[name], at, M) for name, (at, M) in rides.items()),
        left_out,
    )


def _ends(
    urdf: Urdf, above: dict[str, Joint], roots: list[str], base: str | None, tip: str | None
) -> tuple[str, str]:
    """Return base and tip of the chain; for the defaults see ``pick_chain``.

    Raises:
        UserError: if a name is unknown or ambiguous.
    """
    for key, name in (("--base", base), ("--tip", tip)):
        if name is not None and name not in urdf.links:
            raise UserError(
                f"{urdf.path}: {key}: found {shown(name)}, allowed: a link, such as"
                f" {_some(list(urdf.links))}"
            )
    if base is None:
        if len(roots) > 1:
            raise UserError(
                f"{urdf.path}: several links have no parent; choose one with --base: {_some(roots)}"
            )
        base = roots[0]
    return base, tip or _tip(urdf, above, base)


def _moving(urdf: Urdf, path: list[Joint], base: str, tip: str) -> list[Joint]:
    """Return the joints of a path that move.

    Raises:
        UserError: if there are none or too many, or a joint is of a kind that a chain cannot have.
    """
    for joint in path:
        where = f"{urdf.path}: joint {shown(joint.name)}"
        if joint.kind not in ("revolute", "continuous", "prismatic", "fixed"):
            raise UserError(
                f"{where}: type: found {shown(joint.kind)} in the chain, allowed: revolute,"
                " continuous, prismatic, fixed"
            )
        if joint.mimic:
            raise UserError(
                f"{where}: mimic: found {shown(joint.mimic)}, allowed: no mimic in the chain"
            )
    moving = [joint for joint in path if joint.moves]
    if not 1 <= len(moving) <= MOST_JOINTS:
        raise UserError(
            f"{urdf.path}: found {len(moving)} moving joints from {base} to {tip}, allowed: 1 to"
            f" {MOST_JOINTS}"
        )
    return moving


def _folded(
    path: list[Joint], base: str
) -> tuple[dict[str, tuple[int, Transform]], list[Transform]]:
    """Fold the fixed joints of a path into its moving ones.

    Returns:
        The frame of each link on the path with the link's pose in it; and the pose of each frame in
            the one before, with that of the tip in the last frame at the end.
    """
    frame, T, origin = BASE, np.eye(4), []
    rides: dict[str, tuple[int, Transform]] = {base: (frame, T)}
    for joint in path:
        T = T @ joint.T_parent_joint
        if joint.moves:
            origin.append(T)
            frame, T = frame + 1, np.eye(4)
        rides[joint.child] = (frame, T)
    return rides, [*origin, T]


def _carry_branches(urdf: Urdf, rides: dict[str, tuple[int, Transform]]) -> tuple[str, ...]:
    """Add to ``rides`` the links that fixed joints connect to the chain.

    Returns:
        The links that joints outside the chain move.
    """
    below: dict[str, list[Joint]] = {}
    for joint in urdf.joints.values():
        below.setdefault(joint.parent, []).append(joint)
    left_out: list[str] = []
    queue = list(rides)
    while queue:
        name = queue.pop(0)
        for joint in below.get(name, []):
            if joint.child in rides:
                continue
            if joint.moves:
                left_out.append(joint.child)
                continue
            at, M = rides[name]
            rides[joint.child] = (at, M @ joint.T_parent_joint)
            queue.append(joint.child)
    return tuple(left_out)
