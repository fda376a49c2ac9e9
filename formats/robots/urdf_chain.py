"""Serial chain in a URDF: from a base link to a tip, with fixed and held joints folded, and the
links that move with each frame."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...coverage.robots.kinematics import Chain, Mimic
from ...coverage.robots.robot import BASE, HeldJoint
from ..errors import UserError, shown
from .urdf import Joint, Urdf, UrdfLink
from .urdf_arms import ArmEnd, arms
from .urdf_tree import LinkTree
from .xml_text import some

MOST_JOINTS = 20
_SHORTEST = 1e-3  # m, least length of a chain
_CHOICES = 8  # most alternatives in a message

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
    beside: bool = False
    """Whether joints outside the chain lie between link and chain: of a gripper, a piston, another
    arm, or the base below the chain's."""


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
    held: tuple[HeldJoint, ...] = ()
    """Moving joints of the file that are not in the chain, with the values at which they stand."""
    notes: tuple[str, ...] = ()
    """Choices of the reader that a user should know, a sentence each."""


def pick_chain(
    urdf: Urdf,
    base: str | None = None,
    tip: str | None = None,
    hold: Mapping[str, float] | None = None,
) -> Picked:
    """Return the chain from ``base`` to ``tip``.

    By default the chain begins at the root and ends at the tip of the longest arm, before a
    gripper. Joints outside the chain stand at a value: as held, as the joint that they mimic, or
    the one nearest to 0 within their limits.

    Args:
        urdf: the file.
        base: link at which the chain begins.
        tip: link at which it ends.
        hold: values of joints by name, rad or m, that do not move.

    Raises:
        UserError: if links form a loop, a name is unknown or ambiguous, or the chain has no length
            or a joint that it cannot have.
    """
    tree = LinkTree(urdf, dict(hold or {}))
    for key, name in (("--base", base), ("--tip", tip)):
        if name is not None and name not in urdf.links:
            raise UserError(
                f"{urdf.path}: {key}: found {shown(name)}, allowed: a link, such as"
                f" {some(list(urdf.links))}"
            )
    base = _base(tree, tip) if base is None else base
    arm = None if tip is not None else _arm(_open_handed(tree, base), base)
    tip = arm.tip if arm is not None else tip
    assert tip is not None
    return _picked(tree, base, tip, arm)


def _open_handed(tree: LinkTree, base: str) -> LinkTree:
    """Return the tree in which no joint of a gripper is held, as a held finger is no tip."""
    if not tree.hold:
        return tree
    bare = LinkTree(tree.urdf, {})
    begin = {name for arm in arms(bare, base) for name in arm.gripper}
    fingers = begin | {
        below.name for name in begin for below in bare.moving_below(tree.urdf.joints[name])
    }
    return LinkTree(tree.urdf, {n: v for n, v in tree.hold.items() if n not in fingers})


def _foreign(tree: LinkTree, path: list[Joint]) -> list[Joint]:
    """Return the moving joints of a path that a chain cannot have: they mimic a joint that is not
    in it, or one another in a circle."""
    names = {joint.name for joint in path if not tree.still(joint) and not joint.mimic}
    return [
        joint
        for joint in path
        if not tree.still(joint)
        and joint.mimic
        and ((led := tree.leader(joint)) is None or led[0].name not in names)
    ]


def _mimics(tree: LinkTree, moving: list[Joint]) -> tuple[Mimic, ...]:
    """Return how the mimic joints of a chain follow."""
    number = {joint.name: i for i, joint in enumerate(moving)}
    led = [(i, tree.leader(joint)) for i, joint in enumerate(moving)]
    return tuple(
        Mimic(i, number[leader[0].name], leader[1], leader[2])
        for i, leader in led
        if leader is not None
    )


def _limits(moving: list[Joint], mimics: tuple[Mimic, ...]) -> Float[np.ndarray, "J 2"]:
    """Return the limits (J, 2) of a chain, rad or m; those of a leader also keep the joints that
    follow it within theirs, where that leaves some range."""
    limits = np.array([joint.limits for joint in moving])
    for m in mimics:
        if m.multiplier == 0:
            continue
        ends = np.sort((limits[m.joint] - m.offset) / m.multiplier)
        low, high = max(limits[m.leader, 0], ends[0]), min(limits[m.leader, 1], ends[1])
        if low < high:
            limits[m.leader] = low, high
    return limits


def _refuse_joints(tree: LinkTree, path: list[Joint]) -> str:
    """Return why the joints of a path cannot be a chain, and the options that mend it; empty if
    they can."""
    bad = _foreign(tree, path)
    if not bad:
        return ""
    first, hold = bad[0], _hold_options(tree, bad)
    reason = (
        f"joint {shown(first.name)}: mimic: found {shown(first.mimic)}, allowed: another joint"
        " of the chain"
    )
    rest = [j for j in path if not tree.still(j) and j not in bad]
    return reason + (f"; hold it in place: {hold}" if rest else "")


def _hold_options(tree: LinkTree, joints: list[Joint]) -> str:
    return " ".join(f"--hold {j.name}={j.shown(tree.value(j))}" for j in joints)


def _alternatives(tree: LinkTree, base: str, tips: list[str]) -> list[str]:
    """Return, for each tip that yields a chain, the options that choose it."""
    found = []
    for tip in tips:
        path = tree.path(base, tip)
        bad = _foreign(tree, path)
        held = LinkTree(tree.urdf, {**tree.hold, **{j.name: tree.value(j) for j in bad}})
        try:
            _picked(held, base, tip, None)
        except UserError:
            continue
        found.append(f"--tip {tip} {_hold_options(tree, bad)}".strip())
    return found


def _base(tree: LinkTree, tip: str | None) -> str:
    """Return the root above ``tip``, or by default the one with the longest arm."""
    if tip is not None:
        while tip in tree.above:
            tip = tree.above[tip].parent
        return tip
    roots = tree.roots
    longest = {name: max((arm.joints for arm in arms(tree, name)), default=0) for name in roots}
    best = [name for name in roots if longest[name] == max(longest.values())]
    if len(best) > 1 and longest[best[0]]:
        options = ", or ".join(f"--base {name}" for name in best[:_CHOICES])
        raise UserError(f"{tree.urdf.path}: several links have no parent; choose one: {options}")
    return best[0]


def _arm(tree: LinkTree, base: str) -> ArmEnd:
    """Return the longest arm from ``base``.

    Raises:
        UserError: if there is none, or several are equally long.
    """
    path, ends = tree.urdf.path, arms(tree, base)
    found = [arm for arm in ends if not arm.wheel]
    if ends and not found:
        wheels = ", or ".join(f"--tip {arm.tip}" for arm in ends[:_CHOICES])
        raise UserError(
            f"{path}: joint: found wheels only, {some([arm.tip for arm in ends])}, allowed: an arm;"
            f" to take one of them all the same: {wheels}"
        )
    if not found:
        where = f"found 0 moving joints from link {shown(base)}, allowed: 1 to {MOST_JOINTS}"
        raise UserError(f"{path}: joint: {where}; the base (--base) needs a chain of joints")
    longest = [arm for arm in found if arm.joints == found[0].joints]
    if len(longest) == 1:
        return longest[0]
    options = _alternatives(tree, base, [arm.tip for arm in longest])
    if not options:
        return longest[0]  # its refusal says why
    listed = ", or ".join(options[:_CHOICES])
    bases = _own_bases(tree, base, [arm.tip for arm in longest])
    more = f"; or begin at the base of one: {', or '.join(bases[:_CHOICES])}" if bases else ""
    raise UserError(f"{path}: several chains are equally long; choose one: {listed}{more}")


def _own_bases(tree: LinkTree, base: str, tips: list[str]) -> list[str]:
    """Return the option that begins the chain at an arm's own base, for each of several arms that
    share a root; empty unless each has such a link: the last one before its first own joint."""
    paths = [tree.path(base, tip) for tip in tips]
    found = []
    for path in paths:
        shared = {joint.child for other in paths if other is not path for joint in other} | {base}
        own = [joint for joint in path if joint.child not in shared]
        first = next((joint for joint in own if not tree.still(joint)), None)
        if first is None or first.parent in shared:
            return []
        found.append(f"--base {first.parent}")
    return found


def _picked(tree: LinkTree, base: str, tip: str, arm: ArmEnd | None) -> Picked:
    urdf, path = tree.urdf, tree.path(base, tip)
    moving = [joint for joint in path if not tree.still(joint)]
    if not 1 <= len(moving) <= MOST_JOINTS:
        raise UserError(
            f"{urdf.path}: found {len(moving)} moving joints from {base} to {tip}, allowed: 1 to"
            f" {MOST_JOINTS}"
        )
    if reason := _refuse_joints(tree, path):
        raise UserError(f"{urdf.path}: {reason}")
    rides, origin = _folded(tree, path, base)
    if sum(float(np.linalg.norm(M[:3, 3])) for M in origin) < _SHORTEST:
        raise UserError(
            f"{urdf.path}: found a chain without length from {base} to {tip}, allowed:"
            f" at least {_SHORTEST:g} m"
        )
    carried, mimics = _carry_all(tree, rides, moving), _mimics(tree, moving)
    names = {joint.name for joint in moving}
    linked = set(carried)
    held = tuple(
        HeldJoint(j.name, tree.value(j), j.slides)
        for j in urdf.joints.values()
        if j.moves and j.name not in names and j.child in linked
    )
    return Picked(
        urdf,
        base,
        tip,
        Chain(
            tuple(j.name for j in moving),
            np.stack(origin),
            np.stack([j.axis for j in moving]),
            tuple(i for i, j in enumerate(moving) if j.slides),
            mimics,
        ),
        _limits(moving, mimics),
        tuple(carried.values()),
        held,
        (*urdf.notes, *_notes(tree, tip, arm, held, [n for n in urdf.links if n not in linked])),
    )


def _notes(
    tree: LinkTree,
    tip: str,
    arm: ArmEnd | None,
    held: tuple[HeldJoint, ...],
    apart: list[str],
) -> list[str]:
    """Return what a user should know of the choice."""
    notes = []
    if arm is not None and (arm.others or arm.gripper):
        gripper = f", before the gripper ({some(arm.gripper)})" if arm.gripper else ""
        others = f", not {some(arm.others)}" if arm.others else ""
        notes.append(f"The tip is {tip}{others}{gripper}; --tip chooses another.")
    if held:
        values = [f"{h.joint}={tree.urdf.joints[h.joint].shown(h.value)}" for h in held]
        notes.append(f"Joints outside the chain stand still: {some(values)}; --hold sets them.")
    if apart:
        notes.append(f"No joint connects {some(apart)} to the chain: left out.")
    return notes


def _folded(
    tree: LinkTree, path: list[Joint], base: str
) -> tuple[dict[str, tuple[int, Transform]], list[Transform]]:
    """Fold the still joints of a path into its moving ones.

    Returns:
        The frame of each link on the path with the link's pose in it; and the pose of each frame in
            the one before, with that of the tip in the last frame at the end.
    """
    frame, T, origin = BASE, np.eye(4), []
    rides = {base: (BASE, T)}
    for joint in path:
        if tree.still(joint):
            T = T @ joint.T_parent_child(tree.value(joint))
        else:
            origin.append(T @ joint.T_parent_joint)
            frame, T = frame + 1, np.eye(4)
        rides[joint.child] = (frame, T)
    return rides, [*origin, T]


def _carry_all(
    tree: LinkTree, rides: dict[str, tuple[int, Transform]], moving: list[Joint]
) -> dict[str, Carried]:
    """Return all links that joints connect to the chain's links ``rides``, those first."""
    links, chain = tree.urdf.links, {joint.name for joint in moving}
    carried = {name: Carried(links[name], at, M) for name, (at, M) in rides.items()}
    queue = list(carried)
    for name in queue:
        at = carried[name]
        ends = [(j, j.child, True) for j in tree.below.get(name, [])]
        if name in tree.above:
            ends.append((tree.above[name], tree.above[name].parent, False))
        for joint, other, down in ends:
            if other in carried or joint.name in chain:
                continue
            M = joint.T_parent_child(tree.value(joint))
            T = at.T_frame_link @ (M if down else np.linalg.inv(M))
            beside = at.beside or joint.moves or not down
            carried[other] = Carried(links[other], at.frame, T, beside)
            queue.append(other)
    return carried
