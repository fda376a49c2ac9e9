"""Choice of the chain in a URDF: from a base link to a tip, by default along the longest arm."""

from collections.abc import Mapping

from ...coverage.definitions.errors import UserError, shown, unusable
from .urdf_arms import ArmEnd, arms
from .urdf_folding import MOST_JOINTS, Picked, fold_chain, foreign_joints, hold_options
from .urdf_model import Urdf
from .urdf_tree import LinkTree
from .xml_text import some

_CHOICES = 8  # most alternatives in a message


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
            raise unusable(f"{urdf.path}: {key}", name, f"a link, such as {some(list(urdf.links))}")
    base = _base(tree, tip) if base is None else base
    arm = None if tip is not None else _arm(_open_handed(tree, base), base)
    tip = arm.tip if arm is not None else tip
    assert tip is not None
    return fold_chain(tree, base, tip, arm)


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
    limbs = [arm for arm in ends if not arm.wheel]
    if ends and not limbs:
        wheels = ", or ".join(f"--tip {arm.tip}" for arm in ends[:_CHOICES])
        raise UserError(
            f"{path}: joint: found wheels only, {some([arm.tip for arm in ends])}, allowed: an arm;"
            f" to take one of them all the same: {wheels}"
        )
    if not limbs:
        where = f"found 0 moving joints from link {shown(base)}, allowed: 1 to {MOST_JOINTS}"
        raise UserError(f"{path}: joint: {where}; the base (--base) needs a chain of joints")
    longest = [arm for arm in limbs if arm.joints == limbs[0].joints]
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
    bases = []
    for path in paths:
        shared = {joint.child for other in paths if other is not path for joint in other} | {base}
        own = [joint for joint in path if joint.child not in shared]
        first = next((joint for joint in own if not tree.still(joint)), None)
        if first is None or first.parent in shared:
            return []
        bases.append(f"--base {first.parent}")
    return bases


def _alternatives(tree: LinkTree, base: str, tips: list[str]) -> list[str]:
    """Return, for each tip that yields a chain, the options that choose it."""
    options = []
    for tip in tips:
        path = tree.path(base, tip)
        bad = foreign_joints(tree, path)
        held = LinkTree(tree.urdf, {**tree.hold, **{j.name: tree.value(j) for j in bad}})
        try:
            fold_chain(held, base, tip)
        except UserError:
            continue
        options.append(f"--tip {tip} {hold_options(tree, bad)}".strip())
    return options
