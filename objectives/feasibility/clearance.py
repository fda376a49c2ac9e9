"""Where on each link a real ring is clear: it closes around the link, and its envelope keeps a
clearance from every obstacle, and from every body but the tube that it grips, at every pose."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from ...coverage.rings.envelope_clearance import Blocked, blocked_by_capsules, blocked_by_polyhedra
from ...coverage.rings.ring import Ring
from ...coverage.rings.ring_envelope import Envelope, hull
from ...coverage.robots.kinematics import forward
from ...coverage.robots.link_bodies import carried_polyhedra, robot_capsules
from ...coverage.robots.ring_section import axes_of, tube_of
from ...coverage.solids.polyhedra import NOWHERE
from ..link_segments import Room, Stretches
from ..scene import Scene
from .ring_envelopes import closable, envelope, envelopes_by_tilt, spacing

_SAME = 9  # decimals of a metre: bodies that coincide at two poses are evaluated once
# m, by which a radius that is not stated may be changed until the ring is clear
_CHANGES = (0.0, *(sign * 0.005 * i for i in range(1, 11) for sign in (-1, 1)))
_ENOUGH = 0.01  # m of a link
_NAMED = 3  # maximum number of colliding bodies that a message names
_EDGE = 1e-8  # of a link: a ring at the very end of a clear interval is clear
Cuts = list[tuple[float, float, str]]


@dataclass(frozen=True)
class _Things:
    """Capsules and convex bodies in the axis coordinates of a mount."""

    start: Float[np.ndarray, "C 3"]
    """Start of each capsule's axis, m."""
    end: Float[np.ndarray, "C 3"]
    """End of each capsule's axis, m."""
    thick: Float[np.ndarray, " C"]
    """Radius of each capsule, m."""
    normal: Float[np.ndarray, "P M 3"]
    """Face normals of each convex body."""
    offset: Float[np.ndarray, "P M"]
    """Face offsets of each convex body, m."""
    tube: Bool[np.ndarray, " C"]
    """Which capsules are of the link's own tube, which the ring grips."""
    names: list[str]
    """Names of the capsules, then of the convex bodies."""

    def some(self, which: Sequence[int]) -> "_Things":
        """Return the capsules and convex bodies of the numbers ``which``, in ascending order."""
        capsules = [i for i in which if i < len(self.thick)]
        bodies = [i - len(self.thick) for i in which if i >= len(self.thick)]
        return _Things(
            self.start[capsules],
            self.end[capsules],
            self.thick[capsules],
            self.normal[bodies],
            self.offset[bodies],
            self.tube[capsules],
            [self.names[i] for i in which],
        )


class MountClearance:
    """Computes where rings of a scene are clear, and caches the results."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.frames = forward(scene.robot.chain, np.array([p.q for p in scene.poses]))
        self._things: dict[str, _Things] = {}
        self._by_tilt: dict[tuple[str, float], list[Envelope]] = {}
        self._widest: dict[tuple[str, float], Envelope] = {}
        self._cuts: dict[tuple[str, Envelope], Cuts] = {}

    def by_tilt(self, link: str, radius: float) -> list[Envelope]:
        """Return envelopes of new rings of ``radius`` m on ``link`` for ``TILTS``."""
        key = (link, round(radius, _SAME))
        if key not in self._by_tilt:
            self._by_tilt[key] = envelopes_by_tilt(self.scene, *key)
        return self._by_tilt[key]

    def widest(self, link: str, radius: float) -> Envelope:
        """Return an envelope that contains that of any new ring of ``radius`` m on ``link``."""
        key = (link, round(radius, _SAME))
        if key not in self._widest:
            self._widest[key] = hull(self.by_tilt(*key))
        return self._widest[key]

    def stretches(self, link: str, radius: float) -> Stretches:
        """Return all intervals of position on which any new ring of ``radius`` m on ``link`` is
        clear, whatever its tilt.

        They are exact up to about a millimetre at each end.
        """
        around = self.widest(link, radius)
        return _left(closable(self.scene.robot.mount(link), around), self._obstructed(link, around))

    def rooms(self, radii: Mapping[str, float], rings: Sequence[Ring]) -> dict[str, Room]:
        """Return the room of each link for new rings.

        Args:
            radii: radius of new rings on each link, m.
            rings: the rings that are already mounted.
        """
        return {link: self._room(link, radius, rings) for link, radius in radii.items()}

    def _room(self, link: str, radius: float, rings: Sequence[Ring]) -> Room:
        envelopes, mount = self.by_tilt(link, radius), self.scene.robot.mount(link)
        # bodies that no ring meets, whatever its tilt, need not be compared with each envelope
        cuts = self._blocked(self._near(link), link, self.widest(link, radius))
        near = self._near(link).some(sorted({i for a, b, i in cuts if a <= 1 and b >= 0}))
        there = [(ring.position, envelope(self.scene, ring)) for ring in rings if ring.link == link]
        clear = dict[Envelope, Stretches]()
        for e in {*envelopes}:
            cuts = self._blocked(near, link, e)
            if mount.length:
                cuts += [
                    (
                        at - spacing(self.scene, e, other) / mount.length,
                        at + spacing(self.scene, other, e) / mount.length,
                        -1,
                    )
                    for at, other in there
                ]
            clear[e] = _left(closable(mount, e), cuts)
        more = self.scene.rules.clearance
        extents = np.array([[e.high + more for e in envelopes], [-e.low for e in envelopes]])
        return Room([clear[e] for e in envelopes], extents)

    def radius(self, link: str, at_least: float = 0.0) -> float:
        """Return the radius of a new ring on ``link``, m: the scene's, or ``at_least`` if larger.

        A radius that is not stated is changed, by as little as necessary and at most 5 cm, until
        the ring is clear over a centimetre. If none is, it is the one that is clear over the
        longest interval.
        """
        first = max(self.scene.radius_of(link), at_least)
        if self.scene.stated_radius(link) is not None:
            return first
        best, enough = (-1.0, first), min(_ENOUGH, self.scene.robot.mount(link).length)
        least = max(self.scene.smallest_radius(link), at_least)
        for more in _CHANGES:
            radius = max(round(first + more, 4), least)
            stretches = self.stretches(link, radius)
            length = (
                sum(b - a for a, b in stretches) * self.scene.robot.mount(link).length
                if stretches
                else -1.0
            )
            if length > best[0]:
                best = (length, radius)
            if length >= enough:
                break
        return best[1]

    def why(self, link: str, radius: float) -> str:
        """Return a message that names what obstructs a ring on ``link``, or ""."""
        around = self.widest(link, radius)
        low, high = closable(self.scene.robot.mount(link), around)
        if low > high:
            tall = 1000 * (around.high - around.low)
            return f"no ring {tall:.0f} mm tall can be closed around {link}"
        length: dict[str, float] = {}
        for a, b, name in self._obstructed(link, around):
            if a < high and b > low:
                length[name] = length.get(name, 0.0) + min(b, high) - max(a, low)
        first = sorted(length, key=lambda name: -length[name])[:_NAMED]
        return (
            f"a ring of radius {radius:g} m on {link} lies in {', '.join(first)}" if first else ""
        )

    def within(self, ring: Ring) -> list[str]:
        """Return the names of the bodies to which a ring does not keep the clearance at some pose.

        On a mount of length 0 the position is ignored.
        """
        position = ring.position if self.scene.robot.mount(ring.link).length else 0.0
        return list(
            dict.fromkeys(
                name
                for a, b, name in self._obstructed(ring.link, envelope(self.scene, ring))
                if a + _EDGE < position < b - _EDGE
            )
        )

    def closed(self, ring: Ring) -> tuple[float, float]:
        """Return the lowest and highest position at which a ring like ``ring`` closes around its
        link.

        The whole ring must lie in the usable part. If there is no such position, the first value
        exceeds the second.
        """
        return closable(self.scene.robot.mount(ring.link), envelope(self.scene, ring))

    def _obstructed(self, link: str, around: Envelope) -> Cuts:
        """Return the intervals of position on which an envelope is not clear, with the names of
        the bodies."""
        key = (link, around)
        if key not in self._cuts:
            t = self._near(link)
            self._cuts[key] = [(a, b, t.names[i]) for a, b, i in self._blocked(t, link, around)]
        return self._cuts[key]

    def _blocked(self, t: _Things, link: str, around: Envelope) -> list[Blocked]:
        """Return the intervals of position on which an envelope is not clear of bodies, as shares
        of the link, with the numbers of the bodies.

        Within the bore, bodies keep the clearance too, but not those of the link's own tube: the
        clamp grips it, and only the slack of the print (0.5 mm) is between them.
        """
        length, clearance = self.scene.robot.mount(link).length, self.scene.rules.clearance
        grown, share = around.grown(clearance), length or 1.0
        narrow, blocked = replace(grown, bore=max(grown.bore - clearance, 0.0)), list[Blocked]()
        for outline, which in ((grown, t.tube), (narrow, ~t.tube)):
            i = np.flatnonzero(which)
            met = blocked_by_capsules(outline, t.start[i], t.end[i], t.thick[i])
            blocked += [(a, b, int(i[n])) for a, b, n in met]
        solid = blocked_by_polyhedra(grown, t.normal, t.offset, (0.0, length))
        blocked += [(a, b, len(t.thick) + i) for a, b, i in solid]
        return [(a / share, b / share, i) for a, b, i in blocked]

    def _near(self, link: str) -> _Things:
        if link not in self._things:
            self._things[link] = self._gathered(link)
        return self._things[link]

    def _gathered(self, link: str) -> _Things:
        robot, mount = self.scene.robot, self.scene.robot.mount(link)
        T, axes = self.frames[:, mount.frame], axes_of(mount)
        turn = np.einsum("ak,pjk->paj", axes, T[:, :3, :3])  # base frame to axis coordinates
        origin = T[:, :3, 3] + T[:, :3, :3] @ mount.start
        start, end, thick, names = np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), []
        gripped = {body.name for body in tube_of(robot, mount)}
        if robot.bodies:
            capsules = robot_capsules(robot, self.frames)
            ends = [
                np.einsum("paj,pnj->pna", turn, v - origin[:, None])
                for v in (capsules.start, capsules.end)
            ]
            of = np.broadcast_to(np.arange(len(robot.bodies)), ends[0].shape[:2])
            rows = np.concatenate([*(e.reshape(-1, 3) for e in ends), of.reshape(-1, 1)], axis=1)
            _, first = np.unique(np.round(rows, _SAME), axis=0, return_index=True)
            rows = rows[np.sort(first)]
            which = rows[:, 6].astype(int)
            start, end, thick = rows[:, :3], rows[:, 3:6], np.asarray(capsules.radius)[which]
            names = [robot.bodies[i].name for i in which]
        tube = np.array([name in gripped for name in names], bool)
        solid = [(o.name, [o.body] * len(T)) for o in self.scene.obstacles]
        carried = zip(*(carried_polyhedra(robot, p.q) for p in self.scene.poses), strict=True)
        solid += [(c.name, list(at)) for c, at in zip(robot.carried, carried, strict=True)]
        most = max((len(at[0].offset) for _, at in solid), default=1)
        count = len(solid) * len(T)
        normal, offset = np.zeros((count, most, 3)), np.full((count, most), NOWHERE)
        for i, (name, at) in enumerate(solid):
            n = np.stack([body.normal for body in at])  # (P, M, 3)
            faces, here = n.shape[1], slice(i * len(T), (i + 1) * len(T))
            normal[here, :faces] = np.einsum("paj,pmj->pma", turn, n)
            offset[here, :faces] = np.stack([b.offset for b in at]) - np.einsum(
                "pj,pmj->pm", origin, n
            )
            names += [name] * len(T)
        return _Things(start, end, thick, normal, offset, tube, names)


def _left(span: tuple[float, float], cuts: Sequence[tuple[float, float, object]]) -> Stretches:
    """Return ``span`` less ``cuts``."""
    left, low = [], span[0]
    for a, b, *_ in sorted(cuts, key=lambda cut: cut[:2]):
        if a > low:
            left.append((low, min(a, span[1])))
        low = max(low, b)
        if low > span[1]:
            return [s for s in left if s[0] <= s[1]]
    left.append((low, span[1]))
    return [s for s in left if s[0] <= s[1]]
