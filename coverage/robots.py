"""Robots that are built in: their chains, the mount axes of their links, their reach."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .chain import Chain, dh_transform, transform


@dataclass(frozen=True)
class Mount:
    """The axis of a link around which rings sit.

    frame: index into ``forward``'s frames. start (3,) m: the proximal end, in that frame. axis (3,): unit, proximal to
    distal. zero (3,): unit, across the axis; a ring of phase 0 has its first sensor there. length: m; 0 where the place
    along the axis is fixed.
    """

    link: str
    frame: int
    start: Float[np.ndarray, " 3"]
    axis: Float[np.ndarray, " 3"]
    zero: Float[np.ndarray, " 3"]
    length: float

    @property
    def side(self) -> Float[np.ndarray, " 3"]:
        """Third axis of the ring's plane, ``axis x zero``: phase turns from ``zero`` towards it."""
        return np.cross(self.axis, self.zero)


@dataclass(frozen=True)
class Robot:
    """A chain with its mounts. reach: radius of V_O, m."""

    name: str
    chain: Chain
    mounts: tuple[Mount, ...]
    reach: float

    @property
    def links(self) -> tuple[str, ...]:
        return tuple(m.link for m in self.mounts)

    def mount(self, link: str) -> Mount:
        """The mount of ``link``; ValueError names the links there are."""
        for m in self.mounts:
            if m.link == link:
                return m
        raise ValueError(f"robot {self.name} has no link {link!r}; it has {', '.join(self.links)}")


_X, _Y, _Z = np.eye(3)
_O = np.zeros(3)
_UR_JOINTS = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
_QUARTER = math.pi / 2

# Joint origins of the public UR10 (CB3) URDF. The mounts are the centrelines of the links' bodies.
UR10 = Robot(
    name="ur10",
    chain=Chain(
        joints=_UR_JOINTS,
        origin=np.stack(
            [
                transform((0, 0, 0.1273)),
                transform((0, 0.220941, 0), (0, _QUARTER, 0)),
                transform((0, -0.1719, 0.612)),
                transform((0, 0, 0.5723), (0, _QUARTER, 0)),
                transform((0, 0.1149, 0)),
                transform((0, 0, 0.1157)),
                transform((0, 0.0922, 0)),
            ]
        ),
        axis=np.stack([_Z, _Y, _Y, _Y, _Z, _Y]),
    ),
    mounts=(
        Mount("upper_arm", 1, _O, _Z, _X, 0.612),
        Mount("forearm", 2, _O, _Z, _X, 0.5723),
        Mount("tool", 6, _O, _Y, _X, 0.0),
    ),
    reach=1.3,
)

# Frames of the UR10's (CB3) Denavit-Hartenberg table: the link end points P_0 ... P_6 of the paper.
UR10_DH = Robot(
    name="ur10_dh",
    chain=Chain(
        joints=_UR_JOINTS,
        origin=np.stack(
            [
                np.eye(4),
                dh_transform(0.1273, 0, _QUARTER),
                dh_transform(0, -0.612, 0),
                dh_transform(0, -0.5723, 0),
                dh_transform(0.163941, 0, _QUARTER),
                dh_transform(0.1157, 0, -_QUARTER),
                dh_transform(0.0922, 0, 0),
            ]
        ),
        axis=np.stack([_Z] * 6),
    ),
    mounts=(
        Mount("upper_arm", 1, _O, -_X, _Y, 0.612),
        Mount("forearm", 2, _O, -_X, _Y, 0.5723),
        Mount("tool", 6, _O, _Z, _X, 0.0),
    ),
    reach=1.3,
)

ROBOTS = {robot.name: robot for robot in (UR10, UR10_DH)}


def robot(name: str) -> Robot:
    """The built-in robot called ``name``; ValueError lists those there are."""
    if name not in ROBOTS:
        raise ValueError(f"unknown robot {name!r}; known: {', '.join(sorted(ROBOTS))}")
    return ROBOTS[name]
