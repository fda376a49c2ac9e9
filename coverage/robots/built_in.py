"""The robots that are built in, by name."""

from .library.seven_axis import FR3, IIWA14, PANDA
from .library.ur import UR3, UR3E, UR5, UR5E, UR10E, UR16E
from .library.ur10 import UR10, UR10_DH
from .robot import Robot

__all__ = ["PAPER_ROBOTS", "ROBOTS", "UR10", "UR10_DH", "built_in", "robot"]

PAPER_ROBOTS = ("ur10", "ur10_dh")  # the two chains that the paper's UR10 may have had
ROBOTS = {
    robot.name: robot
    for robot in (UR10, UR10_DH, UR3, UR5, UR3E, UR5E, UR10E, UR16E, PANDA, FR3, IIWA14)
}


def robot(name: str) -> Robot:
    """The built-in robot called ``name``; ValueError lists those there are."""
    if name not in ROBOTS:
        raise ValueError(f"unknown robot {name!r}; known: {', '.join(ROBOTS)}")
    return ROBOTS[name]


def built_in(found: Robot) -> bool:
    """Whether this very robot is built in, so that its name says all."""
    return ROBOTS.get(found.name) is found
