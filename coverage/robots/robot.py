"""A robot: its chain, mounts, link bodies, joint limits and reach."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from ..definitions.definition import Fault, refuse
from ..definitions.equality import equal_fields
from ..solids.capsules import Capsules
from ..solids.polyhedra import Polyhedron
from .attached import Attached, CarriedPolyhedron, named, refuse_file
from .calibration import Calibration
from .joint_values import turned_near
from .kinematics import Chain

_ROUNDING = 1e-8  # rad or m, by which a file's value may exceed its limit
BASE = -1  # frame of a body that no joint moves
BASE_FRAME, TCP_FRAME = "base", "tcp"  # names of frames


@dataclass(frozen=True)
class Mount:
    """The axis of a link around which rings sit."""

    link: str
    """Name of the link."""
    frame: int
    """Index into ``forward``'s frames."""
    start: Float[np.ndarray, " 3"]
    """Proximal end in that frame, m."""
    axis: Float[np.ndarray, " 3"]
    """Unit axis, proximal to distal."""
    zero: Float[np.ndarray, " 3"]
    """Unit vector across the axis; a ring of phase 0 has its first sensor there."""
    length: float
    """Length, m; 0 if the place along the axis is fixed."""
    usable: tuple[float, float] = (0.0, 1.0)
    """Lowest and highest position, 0 proximal to 1 distal, at which a real ring closes around the
    link, clear of the joints' housings."""
    section: float = 0.0
    """Radius of the section to be surrounded, m; 0 if unknown."""
    confidence: str = ""
    """How far a ring may rely on the section: high, medium or low; empty if not assessed."""
    basis: str = ""
    """Reason for the confidence."""

    __eq__ = equal_fields

    @cached_property
    def side(self) -> Float[np.ndarray, " 3"]:
        """Third axis of the ring's plane, ``axis x zero``: phases turn from ``zero`` towards it."""
        return np.cross(self.axis, self.zero)

    def T_link_ring(self, position: float) -> Float[np.ndarray, "4 4"]:
        """Return the frame (4, 4) m of a ring at ``position``, seen from the link's frame.

        Its z axis points along the mount axis, and its x axis to the sensor of phase 0.
        """
        T = np.eye(4)
        T[:3, :3] = np.stack([self.zero, self.side, self.axis], axis=1)
        T[:3, 3] = self.start + position * self.length * self.axis
        return T


@dataclass(frozen=True)
class Body:
    """A capsule that represents a part of the robot."""

    name: str
    """Name in messages and exports."""
    frame: int
    """Index into ``forward``'s frames, or ``BASE`` for the base frame."""
    capsule: Capsules
    """A single capsule, in that frame."""


CapsuleRow = tuple[str, int, tuple[float, float, float], tuple[float, float, float], float]
"""Name, frame, ends of the axis, m, and radius, m, of a body."""


def bodies_of(rows: Iterable[CapsuleRow]) -> tuple[Body, ...]:
    """Return the bodies of rows."""
    return tuple(
        Body(name, frame, Capsules(np.array(start), np.array(end), radius))
        for name, frame, start, end, radius in rows
    )


@dataclass(frozen=True)
class HeldJoint:
    """A joint of a URDF that the chain does not move."""

    joint: str
    """Name of the joint."""
    value: float
    """Value at which it stands, rad, or m if it slides."""
    slides: bool = False
    """Whether it is prismatic."""


@dataclass(frozen=True)
class Links:
    """One description of a robot's links."""

    mounts: tuple[Mount, ...]
    """The links' mounts for rings."""
    bodies: tuple[Body, ...]
    """Solid parts of the robot."""


@dataclass(frozen=True)
class Robot:
    """A chain with its mounts."""

    name: str
    """Name of the robot."""
    chain: Chain
    """Joints from base to TCP."""
    mounts: tuple[Mount, ...]
    """The links' mounts for rings, as they are in use."""
    reach: float
    """Radius of V_O about the arm's base, m."""
    bodies: tuple[Body, ...] = ()
    """Solid parts of the robot, as they are in use; may be empty if no computation needs them."""
    limits: Float[np.ndarray, "J 2"] | None = None
    """Lowest and highest value of each joint, rad or, where it is prismatic, m; infinite for
    continuous joints, None if unknown."""
    home: Float[np.ndarray, " J"] | None = None
    """Default pose, rad or m."""
    source: str = ""
    """Source of the figures."""
    held: tuple[HeldJoint, ...] = ()
    """Joints of the robot's URDF that are not in the chain, at the values that the bodies show."""
    tube_links: Links | None = None
    """Mounts and bodies for real rings: the links' own tubes; None: those in use."""
    joint_links: Links | None = None
    """Mounts and bodies for rings without bodies: on the lines between the joints, as in the paper;
    None: those in use."""
    attached: tuple[Attached, ...] = ()
    """Tools and payloads; its capsules are among the bodies. Set by ``with_attached``."""
    carried: tuple[CarriedPolyhedron, ...] = ()
    """The polyhedra of ``attached`` in the frames that carry them. Set by ``with_attached``."""
    unladen: "Robot | None" = None
    """The robot without ``attached``; None if nothing is attached."""
    calibration: Calibration | None = None
    """Source of the chain, if it is this arm's own and not the model's. Set by ``calibrated``."""

    __eq__ = equal_fields

    def __repr__(self) -> str:
        joints, links = len(self.chain), ", ".join(self.links)
        return f"<Robot {self.name}: {joints} joints, reach {self.reach:g} m, mounts on {links}>"

    @property
    def links(self) -> tuple[str, ...]:
        return tuple(m.link for m in self.mounts)

    @property
    def rest(self) -> Float[np.ndarray, " J"]:
        """The default pose (J,) rad or m: ``home``, or the pose nearest to 0 within the limits."""
        if self.home is not None:
            return self.home
        rest = np.zeros(len(self.chain))
        if self.limits is not None:
            rest = np.clip(rest, self.limits[:, 0], self.limits[:, 1])
        return self.chain.settled(rest)

    def beyond(self, q: Float[np.ndarray, " J"]) -> int | None:
        """Return the first joint whose value in ``q`` (J,) violates its limits; None if none.

        Excesses within rounding are accepted.
        """
        if self.limits is None:
            return None
        over = np.flatnonzero(
            (q < self.limits[:, 0] - _ROUNDING) | (q > self.limits[:, 1] + _ROUNDING)
        )
        return int(over[0]) if len(over) else None

    @cached_property
    def _surrounded(self) -> dict[str, float]:
        """Radii that rings on each link surround, m, as far as ``ring_section.surrounded`` has
        computed them."""
        return {}

    @cached_property
    def continuous(self) -> Bool[np.ndarray, " J"]:
        """Which joints (J,) turn without end: revolute ones without limits, where limits are known.

        A joint that leads or follows another is not among them: a full turn of it is none of the
        other.
        """
        if self.limits is None:
            return np.zeros(len(self.chain), bool)
        endless: np.ndarray = ~self.chain.slides & np.isinf(self.limits).all(axis=1)
        for m in self.chain.mimics:
            endless[[m.joint, m.leader]] = False
        return endless

    def unwound(
        self, q: Float[np.ndarray, "*batch J"], near: Float[np.ndarray, " J"] | float = 0.0
    ) -> Float[np.ndarray, "*batch J"]:
        """Return joint values (..., J) with those of continuous joints less the full turns by which
        they are nearest to ``near``, rad."""
        return np.where(self.continuous, turned_near(q, near), q) if self.continuous.any() else q

    def farthest(self, turn: float) -> Float[np.ndarray, " J"]:
        """Return the largest angle (J,) rad that a joint can report: infinite for one without
        limits, else ``turn``, or its limit where that is larger."""
        if self.limits is None:
            return np.full(len(self.chain), turn)
        most: np.ndarray = np.maximum(np.abs(self.limits).max(axis=1), turn)
        return most

    def with_attached(self, attached: tuple[Attached, ...]) -> "Robot":
        """Return the robot with these tools and payloads, in place of any that it carries.

        Capsules become bodies, and polyhedra become ``carried``.

        Raises:
            ValidationError: if a link is unknown, or if the robot has no bodies.
            ValueError: for the mesh in a file.
        """
        bare, last = self.unladen or self, len(self.chain) - 1
        if not attached:
            return bare
        refuse(bare._attached_faults(attached))
        bodies, carried = list(bare.bodies), list[CarriedPolyhedron]()
        for tool in (attached := named(attached, "attached")):
            refuse_file(tool)
            frame, T = bare.carriers[tool.link], np.eye(4)
            if frame > last:  # the TCP, which the last joint moves
                frame, T = last, bare.chain.origin[-1]
            solid = tool.moved(T)
            if isinstance(solid, Polyhedron):
                carried.append(CarriedPolyhedron(tool.name, frame, solid, tool.hulled))
            else:
                bodies.append(Body(tool.name, frame, solid))
        return replace(
            bare,
            bodies=tuple(bodies),
            attached=attached,
            carried=tuple(carried),
            unladen=bare,
        )

    def _attached_faults(self, attached: tuple[Attached, ...]) -> Iterator[Fault]:
        """Yield what the robot cannot carry."""
        for i, tool in enumerate(attached):
            if not self.bodies:
                allowed = f"none, because robot {self.name} has no bodies"
                yield ("attached", i), tool.name, allowed
            elif tool.link not in self.carriers:
                allowed = f"a link of {self.name}: {', '.join(self.carriers)}"
                yield ("attached", i, "link"), tool.link, allowed

    def calibrated(self, chain: Chain, source: str) -> "Robot":
        """Return the robot with a chain of its own, in place of the model's.

        Args:
            chain: the chain; the model's own changes nothing.
            source: file or controller that states it.
        """
        model = self.nominal
        if chain is model.chain:
            return model
        bare = model.unladen or model
        own = replace(bare, chain=chain, calibration=Calibration(bare.chain, source))
        return own.with_attached(self.attached)

    @property
    def nominal(self) -> "Robot":
        """The robot with the chain of its model, without a calibration."""
        bare = self.unladen or self
        if bare.calibration is None:
            return self
        model = replace(bare, chain=bare.calibration.nominal, calibration=None)
        return model.with_attached(self.attached)

    @property
    def carriers(self) -> dict[str, int]:
        """``frames`` with the links of both descriptions, whichever is in use."""
        described = [links.mounts for links in (self.tube_links, self.joint_links) if links]
        return {**{m.link: m.frame for mounts in described for m in mounts}, **self.frames}

    def enclosed(self) -> "Robot":
        """Return the robot with bodies that contain all of it: a capsule about each polyhedron that
        it carries stands for that polyhedron."""
        if not self.carried:
            return self
        capsules = (Body(c.name, c.frame, c.enclosing) for c in self.carried)
        return replace(self, bodies=(*self.bodies, *capsules), carried=())

    def with_links(self, real: bool) -> "Robot":
        """Return the robot with the links for real rings, or for rings without bodies, in use.

        Links in use that are neither of them stay as they are.
        """
        if self.unladen is not None:
            bare = self.unladen.with_links(real)
            return self if bare is self.unladen else bare.with_attached(self.attached)
        wanted, known = self.tube_links if real else self.joint_links, False
        for links in (self.tube_links, self.joint_links):
            if links is not None and links.mounts is self.mounts and links.bodies is self.bodies:
                known = links is not wanted
        if wanted is None or not known:
            return self
        return replace(self, mounts=wanted.mounts, bodies=wanted.bodies)

    @property
    def frames(self) -> dict[str, int]:
        """Index into ``forward``'s frames by name: joints (the link that each moves), ``tcp``, the
        links with mounts, and ``base``."""
        joints = {name: j for j, name in enumerate(self.chain.joints)}
        mounts = {m.link: m.frame for m in self.mounts}
        return {**joints, TCP_FRAME: len(self.chain), **mounts, BASE_FRAME: BASE}

    def frame_of(self, link: str) -> int:
        """Return the index of a link's frame, or ``BASE``; raise a ``ValueError`` that lists the
        names otherwise."""
        if link not in self.frames:
            known = ", ".join(self.frames)
            raise ValueError(f"robot {self.name} has no link {link!r}; known: {known}")
        return self.frames[link]

    def mount(self, link: str) -> Mount:
        """Return the mount of ``link``; raise a ``ValueError`` that lists the links otherwise."""
        for m in self.mounts:
            if m.link == link:
                return m
        raise ValueError(f"robot {self.name} has no link {link!r}; known: {', '.join(self.links)}")
