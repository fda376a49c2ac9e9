"""Search for a known robot in a URDF: the same joints at the same places, and the links that they
move."""

import re
from collections.abc import Iterable, Sequence

import numpy as np

from ...coverage.definitions.errors import UserError, shown, unusable
from ...coverage.robots.robot import Robot
from .urdf_chain import pick_chain
from .urdf_folding import Picked
from .urdf_model import Urdf

# names of frames without special meaning in quoted YAML, xacro or a launch file
ROS_NAME = re.compile(r"[A-Za-z0-9_./-]+")
_CLOSE = 1e-5  # tolerance between URDF and chain, m, and for components of unit vectors


def plain_names(names: Iterable[str], taken: Sequence[str] = ()) -> tuple[str, ...]:
    """Return unique names of ASCII letters, digits and underscores, none of them ``taken``."""
    unique: list[str] = []
    for name in names:
        base = re.sub(r"[^A-Za-z0-9_]", "_", name)
        plain, n = base, 2
        while plain in unique or plain in taken:
            plain, n = f"{base}_{n}", n + 1
        unique.append(plain)
    return tuple(unique)


def chain_between(urdf: Urdf, first: str, last: str, robot: Robot) -> Picked:
    """Return the chain from the link that holds joint ``first`` to the link that joint ``last``
    moves, with the joints held that ``robot`` holds."""
    hold = {h.joint: h.value for h in robot.held if h.joint in urdf.joints}
    return pick_chain(urdf, urdf.joints[first].parent, urdf.joints[last].child, hold)


def find_robot(urdf: Urdf, robot: Robot) -> Picked:
    """Return the chain of ``robot`` in ``urdf``.

    Joints are found by their names or by these as ``plain_names``. The parts before the first joint
    and after the last may differ.

    Raises:
        UserError: if a joint is missing or at another place.
    """
    joints = robot.chain.joints
    names = joints if all(name in urdf.joints for name in joints) else plain_names(joints)
    for name in names:
        if name not in urdf.joints:
            allowed = f"a URDF of robot {robot.name}, with joints {', '.join(names)}"
            raise UserError(
                f"{urdf.path}: joint: found none called {shown(name)}, allowed: {allowed}"
            )
    picked = chain_between(urdf, names[0], names[-1], robot)
    if picked.chain.joints != tuple(names):
        listed = ", ".join(picked.chain.joints)
        raise unusable(
            f"{urdf.path}: joints", listed, f"{', '.join(names)}, the joints of robot {robot.name}"
        )
    for j, name in enumerate(names):
        if picked.chain.slides[j] != robot.chain.slides[j]:
            found, allowed = (
                "prismatic" if chain.slides[j] else "revolute"
                for chain in (picked.chain, robot.chain)
            )
            raise UserError(
                f"{urdf.path}: joint {shown(name)}: type: found {found}, allowed: {allowed}, as in"
                f" robot {robot.name}"
            )
        off = float(np.abs(picked.chain.axis[j] - robot.chain.axis[j]).max())
        if j:
            off = max(off, float(np.abs(picked.chain.origin[j] - robot.chain.origin[j]).max()))
        if off > _CLOSE:
            raise UserError(
                f"{urdf.path}: joint {shown(name)}: found {off:.3g} off its place or axis in robot"
                f" {robot.name}, allowed: at most {_CLOSE:g}"
            )
    return picked


def moved_links(picked: Picked) -> tuple[str, ...]:
    """Return the links of a chain: its base, and the child of each of its joints."""
    return picked.base, *(picked.urdf.joints[name].child for name in picked.chain.joints)
