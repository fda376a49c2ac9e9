"""A chain in a URDF with its fixed and held joints folded, and the links that move with each
frame."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...coverage.definitions.errors import UserError, shown
from ...coverage.robots.kinematics import Chain, Mimic
from ...coverage.robots.robot import BASE, BASE_FRAME, TCP_FRAME, HeldJoint
from .urdf_arms import ArmEnd
from .urdf_model import Joint, Urdf, UrdfLink
from .urdf_tree import LinkTree
from .xml_text import some

MOST_JOINTS = 20
_SHORTEST = 1e-3  # m, least length of a chain

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


def fold_chain(tree: LinkTree, base: str, tip: str, arm: ArmEnd | None = None) -> Picked:
    """Return the chain from ``base`` to ``tip``; ``arm`` is the arm of which the tip is the end, if
    the reader chose it.

    Raises:
        UserError: if the chain has no length, or joints that it cannot have.
    """
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


def foreign_joints(tree: LinkTree, path: list[Joint]) -> list[Joint]:
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


def _refuse_joints(tree: LinkTree, path: list[Joint]) -> str:
    """Return why the joints of a path cannot be a chain, and the options that mend it; empty if
    they can."""
    taken = [j.name for j in path if not tree.still(j) and j.name in (BASE_FRAME, TCP_FRAME)]
    if taken:
        allowed = f"other names than {BASE_FRAME} and {TCP_FRAME}, which name frames here"
        return f"joint: found {shown(taken[0])}, a moving joint; allowed: {allowed}"
    bad = foreign_joints(tree, path)
    if not bad:
        return ""
    first, hold = bad[0], hold_options(tree, bad)
    reason = (
        f"joint {shown(first.name)}: mimic: found {shown(first.mimic)}, allowed: another joint"
        " of the chain"
    )
    rest = [j for j in path if not tree.still(j) and j not in bad]
    return reason + (f"; hold it in place: {hold}" if rest else "")


def hold_options(tree: LinkTree, joints: list[Joint]) -> str:
    """Return the options that hold joints where they stand."""
    return " ".join(f"--hold {j.name}={j.shown(tree.value(j))}" for j in joints)


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
