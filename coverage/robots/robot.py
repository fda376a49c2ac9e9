"""A robot: its chain, the mount axes and the bodies of its links, its joints' limits, its reach."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from ..solids.capsules import Capsules
from .kinematics import Chain

_ROUNDING = 1e-8  # rad, by which an angle of a file may be over its limit
BASE = -1  # the frame of a body that no joint moves


@dataclass(frozen=True)
class Mount:
    """The axis of a link around which rings sit.

    frame: index into ``forward``'s frames. start (3,) m: the proximal end, in that frame. axis
    (3,): unit, proximal to distal. zero (3,): unit, across the axis; a ring of phase 0 has its
    first sensor there. length: m; 0 where the place along the axis is fixed. usable: lowest and
    highest position, 0 proximal to 1 distal, at which a real ring can be closed around the link,
    clear of the joints' housings. section: m, radius of what is to be surrounded there, 0 where
    nothing is known; aside: m, how far beside the axis it lies, and
    toward: rad, on which side: as a ring's phase says it.
    """

    link: str
    frame: int
    start: Float[np.ndarray, " 3"]
    axis: Float[np.ndarray, " 3"]
    zero: Float[np.ndarray, " 3"]
    length: float
    usable: tuple[float, float] = (0.0, 1.0)
    section: float = 0.0
    aside: float = 0.0
    toward: float = 0.0

    @cached_property
    def side(self) -> Float[np.ndarray, " 3"]:
        """Third axis of the ring's plane, ``axis x zero``: phase turns from ``zero`` towards it."""
        return np.cross(self.axis, self.zero)


@dataclass(frozen=True)
class Body:
    """A capsule that stands for a part of the robot."""

    name: str
    """What messages and exports call it."""
    frame: int
    """Index into ``forward``'s frames, or ``BASE``: the base frame."""
    capsule: Capsules
    """A single one, in that frame."""


@dataclass(frozen=True)
class Robot:
    """A chain with its mounts.

    reach: radius of V_O, m. bodies: the robot's solid; none where nothing asks for it. limits (J,
    2) rad: lowest and highest angle of each joint, infinite where it turns freely; none where they
    are not known. home (J,) rad: the pose where a scene has none. source: where the figures are
    from.
    """

    name: str
    chain: Chain
    mounts: tuple[Mount, ...]
    reach: float
    bodies: tuple[Body, ...] = ()
    limits: Float[np.ndarray, "J 2"] | None = None
    home: Float[np.ndarray, " J"] | None = None
    source: str = ""

    def __repr__(self) -> str:
        joints, links = len(self.chain), ", ".join(self.links)
        return f"<Robot {self.name}: {joints} joints, reach {self.reach:g} m, mounts on {links}>"

    @property
    def links(self) -> tuple[str, ...]:
        return tuple(m.link for m in self.mounts)

    @property
    def rest(self) -> Float[np.ndarray, " J"]:
        """The pose (J,) rad where none is given: ``home``, or all joints at 0, or as near to it as
        their limits allow.
        """
        if self.home is not None:
            return self.home
        rest = np.zeros(len(self.chain))
        return rest if self.limits is None else np.clip(rest, self.limits[:, 0], self.limits[:, 1])

    def beyond(self, q: Float[np.ndarray, " J"]) -> int | None:
        """The first joint whose angle in ``q`` (J,) rad is beyond its limits by more than rounding;
        None where none is.
        """
        if self.limits is None:
            return None
        over = np.flatnonzero(
            (q < self.limits[:, 0] - _ROUNDING) | (q > self.limits[:, 1] + _ROUNDING)
        )
        return int(over[0]) if len(over) else None

    def mount(self, link: str) -> Mount:
        """The mount of ``link``; ValueError names the links there are."""
        for m in self.mounts:
            if m.link == link:
                return m
        raise ValueError(f"robot {self.name} has no link {link!r}; it has {', '.join(self.links)}")
