"""The built-in robots, by name."""

from dataclasses import fields

from .library.seven_axis import FR3, IIWA14, PANDA
from .library.ur import UR3, UR3E, UR5, UR5E, UR10E, UR16E
from .library.ur10 import UR10, UR10_DH
from .robot import Robot

__all__ = ["PAPER_ROBOTS", "ROBOTS", "UR10", "UR10_DH", "built_in", "robot"]

PAPER_ROBOTS = ("ur10", "ur10_dh")  # two possible readings of the paper's UR10
ROBOTS = {
    robot.name: robot
    for robot in (UR10, UR10_DH, UR3, UR5, UR3E, UR5E, UR10E, UR16E, PANDA, FR3, IIWA14)
}


def robot(name: str) -> Robot:
    """Return the built-in robot ``name``; raise a ``ValueError`` that lists the known names."""
    if name not in ROBOTS:
        raise ValueError(f"unknown robot {name!r}; known: {', '.join(ROBOTS)}")
    return ROBOTS[name]


def built_in(found: Robot) -> bool:
    """Return whether this object is a built-in robot, with either of its sets of mounts in use, so
    that its name identifies it."""
    known = ROBOTS.get(found.name)
    if known is None or found is known:
        return known is not None
    sets = (known.mounts, known.tube_mounts, known.joint_mounts)
    kept = (field.name for field in fields(known) if field.name != "mounts")
    return any(found.mounts is mounts for mounts in sets) and all(
        getattr(found, name) is getattr(known, name) for name in kept
    )
