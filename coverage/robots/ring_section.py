"""The cross section that a ring surrounds: the link's tube about the mount axis."""

import numpy as np
from jaxtyping import Float

from .robot import BASE, Body, Mount, Robot

# cosine: a body within 30 degrees of its mount's axis counts as the tube that rings surround
_ALONG = 0.866
_BALL = 0.5  # length of a capsule's axis, as a share of its radius, below which it counts as a ball
_EXCESS = 1.2  # extent of a small body at the TCP, as a share of the measured section
_PLACES = 65  # sample points along a body's axis
_BEYOND = 0.025  # m, on either side of a mount without length, that a ring may surround


def tube_of(robot: Robot, mount: Mount) -> list[Body]:
    """Return the bodies of a mount's own link that its rings surround, in the mount's frame.

    They lie along its axis, or are balls about it; housings across it are excluded. The last link
    carries the TCP, so its bodies belong to a mount at the TCP as well, and also those that exceed
    the measured section by a fifth at most. What is attached to the robot is no part of a tube:
    rings keep clear of it.
    """
    last, tubes = len(robot.chain) - 1, []
    for body in (robot.unladen or robot).bodies:
        start, end = body.capsule.start, body.capsule.end
        if body.frame == last and mount.frame == last + 1:
            T = np.linalg.inv(robot.chain.origin[-1])
            start, end = (T[:3, :3] @ v + T[:3, 3] for v in (start, end))
        elif body.frame != mount.frame or body.frame == BASE:
            continue
        along, radius = end - start, float(body.capsule.radius)
        length = float(np.linalg.norm(along))
        off = np.linalg.norm(np.cross((start + end) / 2 - mount.start, mount.axis))
        ball = length < _BALL * radius and off < radius / 2
        small = mount.length == 0 and off + length / 2 + radius < _EXCESS * mount.section
        if ball or small or (length > 0 and abs(along @ mount.axis) > _ALONG * length):
            tubes.append(Body(body.name, mount.frame, type(body.capsule)(start, end, radius)))
    return tubes


def axes_of(mount: Mount) -> Float[np.ndarray, "3 3"]:
    """Return the mount's axis, zero and side as rows, in the frame of its link."""
    return np.stack([mount.axis, mount.zero, mount.side])


def surrounded(robot: Robot, link: str) -> float:
    """Return the radius about the mount axis of ``link``, m, that a ring must surround.

    It covers the measured section and the capsules of the
    tube: over the whole usable interval where a capsule's axis passes its middle, otherwise at that
    middle. A ring on a mount without length surrounds 25 mm on either side of it. It is computed
    once for a robot's link.
    """
    if link not in robot._surrounded:
        robot._surrounded[link] = _surrounded(robot, link)
    return robot._surrounded[link]


def _surrounded(robot: Robot, link: str) -> float:
    mount = robot.mount(link)
    low, high = (end * mount.length for end in mount.usable)
    if mount.length == 0:
        low, high = -_BEYOND, _BEYOND
    middle, outermost = (low + high) / 2, mount.section
    for body in tube_of(robot, mount):
        ends = (np.stack([body.capsule.start, body.capsule.end]) - mount.start) @ axes_of(mount).T
        places = ends[0] + np.linspace(0, 1, _PLACES)[:, None] * (ends[1] - ends[0])
        off, radius = np.hypot(places[:, 1], places[:, 2]), float(body.capsule.radius)
        passes = min(ends[:, 0]) <= middle <= max(ends[:, 0]) or mount.length == 0
        near, far = (low, high) if passes else (middle, middle)
        ahead = np.maximum(np.maximum(near - places[:, 0], places[:, 0] - far), 0.0)
        reach = off + np.sqrt(np.maximum(radius**2 - ahead**2, 0.0))
        outermost = max(outermost, float(np.max(reach, where=ahead < radius, initial=0.0)))
    return outermost
