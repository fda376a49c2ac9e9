"""Tree of a URDF's links: which joint carries each link, at which values joints stand that no chain
moves, and which links are rigid together."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from ...coverage.definitions.errors import UserError, shown, unusable
from .urdf_model import Joint, Urdf
from .xml_text import some


@dataclass(frozen=True)
class LinkTree:
    """The links of a URDF with the joints above and below them."""

    urdf: Urdf
    """The file."""
    hold: Mapping[str, float]
    """Values of held joints by name, rad or m: fixed joints of this tree."""
    above: dict[str, Joint] = field(default_factory=dict)
    """The joint that carries each link but the roots."""
    below: dict[str, list[Joint]] = field(default_factory=dict)
    """The joints that each link carries."""

    def __post_init__(self) -> None:
        for joint in self.urdf.joints.values():
            if joint.child in self.above:
                raise UserError(
                    f"{self.urdf.path}: joint {shown(joint.name)}: child: found"
                    f" {shown(joint.child)}, which joint {shown(self.above[joint.child].name)}"
                    " carries already; allowed: one parent joint for each link"
                )
            self.above[joint.child] = joint
            self.below.setdefault(joint.parent, []).append(joint)
        self._refuse_loops()
        self._check_held()

    def _refuse_loops(self) -> None:
        clear: set[str] = set()
        for name in self.urdf.links:
            seen, at = {name}, name
            while at in self.above and at not in clear:
                at = self.above[at].parent
                if at in seen:
                    raise UserError(
                        f"{self.urdf.path}: link {shown(at)}: found a loop of joints through it,"
                        " allowed: a tree"
                    )
                seen.add(at)
            clear |= seen

    def _check_held(self) -> None:
        joints = self.urdf.joints
        for name, value in self.hold.items():
            if name not in joints or not self.urdf.joints[name].moves:
                moving = [joint.name for joint in joints.values() if joint.moves]
                raise unusable(
                    f"{self.urdf.path}: --hold", name, f"a moving joint, such as {some(moving)}"
                )
            joint, slack = joints[name], 1e-6
            low, high = joint.limits
            if joint.kind in ("planar", "floating") and value != 0:
                raise UserError(
                    f"{self.urdf.path}: --hold: found {shown(name)}, a {joint.kind} joint, at"
                    f" {value:g}, allowed: 0, its origin"
                )
            # where a mimic joint stands, the other joint decides
            if not joint.mimic and not low - slack <= value <= high + slack:
                unit = "m" if joint.slides else "degrees"
                raise UserError(
                    f"{self.urdf.path}: --hold: found {name}={joint.shown(value)}, allowed:"
                    f" {joint.shown(low)} to {joint.shown(high)} {unit}"
                )

    @property
    def roots(self) -> list[str]:
        """The links that no joint carries."""
        return [name for name in self.urdf.links if name not in self.above]

    def still(self, joint: Joint) -> bool:
        """Return whether a joint moves nothing in this tree: fixed, held, or the joint of a mobile
        base, planar or floating, which stays at its origin. What mimics a held joint stands
        still, too."""
        if not joint.moves or joint.name in self.hold or joint.kind in ("planar", "floating"):
            return True
        leader = self.leader(joint)
        return leader is not None and leader[0].name in self.hold

    def leader(self, joint: Joint) -> tuple[Joint, float, float] | None:
        """Return the joint that a joint follows in the end, with multiplier and offset; None if it
        follows none, or mimics in a circle."""
        factor, offset, seen = 1.0, 0.0, {joint.name}
        while joint.mimic and joint.name not in self.hold:
            factor, offset = factor * joint.multiplier, offset + factor * joint.offset
            joint = self.urdf.joints[joint.mimic]
            if joint.name in seen:
                return None
            seen.add(joint.name)
        return (joint, factor, offset) if len(seen) > 1 else None

    def value(self, joint: Joint) -> float:
        """Return the value of a joint outside the chain, rad or m: as held, as the joint that it
        mimics, or the one nearest to 0 within its limits."""
        joint, factor, offset = self.leader(joint) or (joint, 1.0, 0.0)
        value = factor * self.hold.get(joint.name, joint.default) + offset
        return value if math.isfinite(value) else 0.0

    def rigid(self, link: str) -> dict[str, int]:
        """Return the links that still joints connect below ``link``, and how many joints lead to
        each."""
        depths, queue = {link: 0}, [link]
        for name in queue:
            for joint in self.below.get(name, []):
                if self.still(joint):
                    depths[joint.child] = depths[name] + 1
                    queue.append(joint.child)
        return depths

    def exits(self, link: str) -> list[Joint]:
        """Return the moving joints that leave the links rigid with ``link``."""
        return [
            j for name in self.rigid(link) for j in self.below.get(name, []) if not self.still(j)
        ]

    def moving_below(self, joint: Joint) -> list[Joint]:
        """Return the moving joints that a joint carries."""
        moving, queue = [], self.exits(joint.child)
        for at in queue:
            moving.append(at)
            queue += self.exits(at.child)
        return moving

    def path(self, base: str, tip: str) -> list[Joint]:
        """Return the joints from base to tip.

        Raises:
            UserError: if no joints lead there.
        """
        path, at = [], tip
        while at != base:
            if at not in self.above:
                raise unusable(
                    f"{self.urdf.path}: --tip", tip, f"a link that joints connect to {base}"
                )
            path.append(self.above[at])
            at = self.above[at].parent
        return path[::-1]
