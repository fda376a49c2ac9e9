"""Cables from the base along the arm to each ring: the joints they cross, how far they slip there,
and their lengths.

A cable that lies on the arm at a distance r from a joint's axis slips by r Δq when the joint turns
by Δq, so its loop at the joint holds that much and a little more. Between two joints it runs
straight, with an allowance for bends and clips.
"""

import math
from dataclasses import dataclass

import numpy as np

from ...coverage.rings.ring import Group, Ring
from ...coverage.robots.robot import Robot
from ...objectives.scene import Scene

USB_M = 5.0  # longest cable of USB 2.0 without a hub (USB 2.0 specification, cable delay 26 ns)
_LAY = 1.1  # length of a cable laid along the links, over the straight line
_LEAST_LOOP = 0.05  # m, of cable at each joint
_OUTSIDE = 0.01  # m, of the cable outside the link's body
_RADIUS = 0.06  # m, of a link whose body is unknown
_ENDS = 0.3  # m, of cable at both ends together
_STEP = 0.1  # m, lengths are rounded up to


@dataclass(frozen=True)
class JointCrossing:
    """A joint that cables cross."""

    joint: str
    """Name of the joint."""
    slides: bool
    """Whether the joint is prismatic."""
    motion: float
    """Motion of the joint, rad or m: over the scene's poses, or, with one pose, over its limits, at
    most one turn."""
    radius: float
    """Distance of the cable from a revolute joint's axis, m; 0 for a prismatic joint."""

    @property
    def slip(self) -> float:
        """Length by which a cable slips across the joint, m."""
        return self.motion if self.slides else self.radius * self.motion

    @property
    def loop(self) -> float:
        """Length of cable to leave at the joint, m."""
        return max(_LEAST_LOOP, self.slip)


@dataclass(frozen=True)
class CableRun:
    """The cable from the base to a ring or a single sensor."""

    joints: int
    """Number of joints between base and ring; the cable crosses the first so many."""
    along: float
    """Straight length along the links, m."""
    loops: float
    """Length of the loops at the joints, m."""

    @property
    def length(self) -> float:
        """Length to buy, m, rounded up to 0.1 m."""
        return math.ceil((_LAY * self.along + self.loops + _ENDS) / _STEP - 1e-9) * _STEP

    @property
    def usb(self) -> bool:
        """Whether a USB 2.0 cable may be that long."""
        return self.length <= USB_M + 1e-9


def crossings(scene: Scene) -> list[JointCrossing]:
    """Return the joints of a scene's robot, from base to tool, with their motions."""
    robot, chain = scene.robot, scene.robot.chain
    q = chain.settled(np.array([pose.q for pose in scene.poses]))
    over = np.ptp(q, axis=0)
    crossed = []
    for j, joint in enumerate(chain.joints):
        slides = bool(chain.slides[j])
        motion = float(over[j])
        if len(scene.poses) == 1:
            low, high = (-np.inf, np.inf) if robot.limits is None else robot.limits[j]
            most = 0.5 if slides else math.tau
            motion = min(float(high - low), most)
        crossed.append(JointCrossing(joint, slides, motion, 0.0 if slides else _lever(robot, j)))
    return crossed


def _lever(robot: Robot, joint: int) -> float:
    """Return the distance, m, of a cable on the link that a joint moves from the joint's axis."""
    bodies = (robot.unladen or robot).bodies
    radii = [float(body.capsule.radius) for body in bodies if body.frame == joint]
    return max(radii, default=_RADIUS) + _OUTSIDE


def cable_run(scene: Scene, group: Group) -> CableRun:
    """Return the cable from the base to a ring, or to a single sensor."""
    chain = scene.robot.chain
    if isinstance(group, Ring):
        mount = scene.robot.mount(group.link)
        frame = mount.frame
        place = mount.start + group.position * mount.length * mount.axis
    else:
        frame, place = scene.robot.frame_of(group.link), np.array(group.position)
    joints = min(frame + 1, len(chain))
    steps = np.linalg.norm(chain.origin[: frame + 1, :3, 3], axis=1)
    along = float(steps.sum() + np.linalg.norm(place))
    loops = sum(crossing.loop for crossing in crossings(scene)[:joints])
    return CableRun(joints, along, loops)
