"""Arms of a URDF: where each ends, where its gripper begins, and which link there is the tip."""

import re
from dataclasses import dataclass

from .urdf_model import Joint
from .urdf_tree import LinkTree

# in the name of a joint; the first ones also in that of its link: a wrist carries a "gripper_link"
_FINGER = re.compile(r"finger|thumb|knuckle|jaw|claw", re.IGNORECASE)
_GRASPING = re.compile(r"gripper|grasp", re.IGNORECASE)
_WHEEL = re.compile(r"wheel|caster|castor|roller|track_", re.IGNORECASE)
_STEERED = 2  # most joints of a wheel: one that steers it, and its own
_HAND = 4  # most joints one after another in a finger
_WRIST = 3  # least joints before a hand that no name tells
# names of tips, the best first; then links that carry no tool
_TIPS = tuple(
    re.compile(pattern, re.IGNORECASE)
    for pattern in (
        r"tool_?0$",
        r"tcp(_link|_frame)?$",
        r"flange(_link|_frame)?$",
        r"tool(_link|_frame|_center_point)?$",
        r"ee(_link|_arm_link|_frame|_base_link|_gripper_link)?$",
        r"end_?effector(_link|_frame)?$",
        r"^tip$",
        r"gripper(_link|_frame|_tool_frame|_base|_base_link)?$",
        r"(hand|palm)(_link|_frame)?$",
    )
)
_NO_TIP = re.compile(
    r"camera|optical|tof_|finger|depth|color|colour|rgb|imu|accelero|gyro|laser|lidar|sensor|screen|"
    r"display|light|"
    r"_sc$|_inertia|collision|visual|_ft$|cover|cable|hose|mount$",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class ArmEnd:
    """The end of a chain of moving joints that is no finger's."""

    joints: int
    """Number of moving joints from the base."""
    tip: str
    """Link at the tip."""
    others: tuple[str, ...]
    """Other ends of the links that the last joint carries."""
    gripper: tuple[str, ...]
    """Joints at which the gripper begins."""
    wheel: bool = False
    """Whether it is a wheel of a mobile base, by its name and its few joints."""


def _depth(tree: LinkTree, joint: Joint, most: int) -> int:
    """Return the largest number of moving joints one after another from ``joint`` on, at most
    ``most``."""
    below = tree.exits(joint.child) if most > 1 else []
    return 1 + max((_depth(tree, other, most - 1) for other in below), default=0)


def _named(joint: Joint) -> bool:
    named = _GRASPING.search(joint.name) or _FINGER.search(joint.name)
    return bool(named or _FINGER.search(joint.child))


def _carries_tool(tree: LinkTree, joint: Joint) -> bool:
    """Return whether a tool's frame moves rigidly with a joint."""
    return any(pattern.search(name) for name in tree.rigid(joint.child) for pattern in _TIPS[:7])


def _grasps(tree: LinkTree, joint: Joint, followed: set[str]) -> bool:
    """Return whether a gripper, or a piston, begins at a joint of an arm.

    It does where the joint mimics another, is mimicked (``followed``), slides without a tool frame
    beyond (a quill has one), or has a finger's name, and no joint below turns on its own.
    """
    gripping = joint.mimic or joint.name in followed or _named(joint)
    if not gripping and (joint.kind != "prismatic" or _carries_tool(tree, joint)):
        return False
    return all(
        other.kind == "prismatic" or other.mimic or _named(other)
        for other in tree.moving_below(joint)
    )


def _hand(tree: LinkTree, exits: list[Joint], joints: int) -> bool:
    """Return whether several short branches of equal length leave an arm: fingers without such
    names."""
    if joints < _WRIST or len(exits) < 2:
        return False
    depths = sorted((_depth(tree, joint, _HAND + 1) for joint in exits), reverse=True)
    return depths[1] == depths[0] <= _HAND


def _rank(name: str) -> int:
    return next((i for i, pattern in enumerate(_TIPS) if pattern.search(name)), len(_TIPS))


def _ends(tree: LinkTree, link: str) -> tuple[str, tuple[str, ...]]:
    """Return the tip among the links rigid with ``link``, and the others that it could be.

    That is the link with the best name, then the one behind most fixed joints, then the first.
    """
    rigid = tree.rigid(link)
    order = sorted(rigid, key=lambda n: (_rank(n), bool(_NO_TIP.search(n)), -rigid[n]))
    ends = [n for n in order if not any(j.child in rigid for j in tree.below.get(n, []))]
    return order[0], tuple(name for name in ends if name != order[0])


def arms(tree: LinkTree, base: str) -> list[ArmEnd]:
    """Return the ends of all arms from ``base``, the longest first."""
    ends: list[ArmEnd] = []
    followed = {joint.mimic for joint in tree.urdf.joints.values()}
    queue = [(base, 0)]
    for link, joints in queue:
        exits = tree.exits(link)
        if joints and _hand(tree, exits, joints):
            grasping = exits
        else:
            grasping = [joint for joint in exits if joints and _grasps(tree, joint, followed)]
        ahead = [joint for joint in exits if joint not in grasping]
        queue += [(joint.child, joints + 1) for joint in ahead]
        if joints and not ahead:
            tip, others = _ends(tree, link)
            rolls = _WHEEL.search(link) or _WHEEL.search(tree.above[link].name)
            wheel = joints <= _STEERED and rolls is not None
            ends.append(ArmEnd(joints, tip, others, tuple(j.name for j in grasping), wheel))
    return sorted(ends, key=lambda arm: -arm.joints)
