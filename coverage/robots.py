"""Robots that are built in: their chains, the mount axes and the bodies of their links, their reach."""

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
class Body:
    """A capsule that stands for a part of the robot: all points within ``radius`` m of the segment from ``start`` to ``end``
    (3,) m, both in frame ``frame`` of ``forward``'s."""

    name: str
    frame: int
    start: Float[np.ndarray, " 3"]
    end: Float[np.ndarray, " 3"]
    radius: float


@dataclass(frozen=True)
class Robot:
    """A chain with its mounts. reach: radius of V_O, m. bodies: the robot's solid; none where nothing asks for it."""

    name: str
    chain: Chain
    mounts: tuple[Mount, ...]
    reach: float
    bodies: tuple[Body, ...] = ()

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
    # Radii of the public collision meshes' tubes and housings, on the mounts' axes: thinner than the paper's rings. The base
    # turns about its own axis, so that it may ride on the first frame.
    bodies=(
        Body("base", 0, -0.0523 * _Z, _O, 0.075),
        Body("shoulder", 0, _O, 0.185 * _Y, 0.075),
        Body("upper_arm", 1, _O, 0.612 * _Z, 0.054),
        Body("elbow", 1, 0.612 * _Z, 0.612 * _Z - 0.1719 * _Y, 0.06),
        Body("forearm", 2, _O, 0.5723 * _Z, 0.045),
        Body("wrist_1", 3, _O, 0.1149 * _Y, 0.046),
        Body("wrist_2", 4, _O, 0.1157 * _Z, 0.046),
        Body("wrist_3", 5, _O, 0.0472 * _Y, 0.045),
    ),
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
    # The same radii on the lines between the link end points, as this chain leaves out the links' sideways offsets.
    bodies=(
        Body("base", 0, 0.075 * _Z, 0.1273 * _Z, 0.075),
        Body("upper_arm", 1, _O, -0.612 * _X, 0.054),
        Body("forearm", 2, _O, -0.5723 * _X, 0.045),
        Body("wrist_1", 3, _O, 0.163941 * _Z, 0.046),
        Body("wrist_2", 4, _O, 0.1157 * _Z, 0.046),
        Body("wrist_3", 5, _O, 0.0472 * _Z, 0.045),
    ),
)

ROBOTS = {robot.name: robot for robot in (UR10, UR10_DH)}


def robot(name: str) -> Robot:
    """The built-in robot called ``name``; ValueError lists those there are."""
    if name not in ROBOTS:
        raise ValueError(f"unknown robot {name!r}; known: {', '.join(sorted(ROBOTS))}")
    return ROBOTS[name]
