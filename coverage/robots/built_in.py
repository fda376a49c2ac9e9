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
    """Return whether this object is a built-in robot, with either description of its links in use,
    so that its name identifies it."""
    known = ROBOTS.get(found.name)
    if known is None:
        return False
    names = [field.name for field in fields(known)]
    return any(
        all(getattr(found, name) is getattr(one, name) for name in names)
        for one in (known, known.with_links(True), known.with_links(False))
    )
