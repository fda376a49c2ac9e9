"""Where on each link a real ring is clear: it closes around the link and intersects no body and no
obstacle at any pose of the scene.

A ring's body is a band about its circle: all points within half its thickness of the circle's
copies along the axis, over the band's width. The ring is clear at a position if the circle keeps a
clearance of half the thickness all along the band. This is one function of one coordinate, which
``circle_clearance`` bounds from below. The sensors' apexes lie on the circle, so they are clear
with it.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...coverage.occlusion.circle_clearance import blocked, capsule_gap, plane_gap
from ...coverage.robots.kinematics import forward
from ...coverage.robots.link_bodies import robot_capsules
from ...coverage.robots.ring_section import axes_of
from ...coverage.solids.polyhedra import NOWHERE
from ..scene import Scene

_SAME = 9  # decimals of a metre: bodies that coincide at two poses are evaluated once
# m, by which a radius that is not stated may be raised until the ring is clear
_MORE = tuple(0.005 * i for i in range(11))
_ENOUGH = 0.01  # m of a link
_NAMED = 3  # maximum number of colliding bodies that a message names
_EDGE = 1e-8  # of a link: a ring at the very end of a clear interval is clear
Stretches = list[tuple[float, float]]
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
    names: list[str]
    """Names of the capsules, then of the convex bodies."""


class MountClearance:
    """Computes where rings of a scene are clear, and caches the results."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.frames = forward(scene.robot.chain, np.array([p.q for p in scene.poses]))
        self._things: dict[str, _Things] = {}
        self._found: dict[tuple[str, float], tuple[Stretches, Cuts]] = {}

    def stretches(self, link: str, radius: float) -> Stretches:
        """Return all intervals of position on which a ring of ``radius`` m on ``link`` is clear.

        They are exact up to a fraction of a millimetre at each end.
        """
        return self._of(link, radius)[0]

    def radius(self, link: str, at_least: float = 0.0) -> float:
        """Return the radius of a new ring on ``link``, m: the scene's, or ``at_least`` if larger.

        A radius that is not stated is the smallest one that is clear over a centimetre. If there is
        none, it is the one, up to 5 cm above the minimum, that is clear over the longest interval.
        """
        first = max(self.scene.radius_of(link), at_least)
        if self.scene.stated_radius(link) is not None:
            return first
        best, enough = (-1.0, first), min(_ENOUGH, self.scene.robot.mount(link).length)
        for more in _MORE:
            radius = round(first + more, 4)
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
        (low, high), cuts = self.closed(link), self._of(link, radius)[1]
        if low > high:
            return (
                f"no ring {1000 * self.scene.rules.band[1]:g} mm wide can be closed around {link}"
            )
        length: dict[str, float] = {}
        for a, b, name in cuts:
            length[name] = length.get(name, 0.0) + max(min(b, high) - max(a, low), 0.0)
        first = sorted(
            (n for n in length if low == high or length[n] > 0), key=lambda name: -length[name]
        )[:_NAMED]
        return (
            f"a ring of radius {radius:g} m on {link} lies in {', '.join(first)}" if first else ""
        )

    def within(self, link: str, radius: float, position: float) -> list[str]:
        """Return the names of the bodies in which a ring at ``position`` lies at some pose.

        Bodies from which the ring is not proven clear are included. On a mount of length 0 the
        position is ignored.
        """
        position = position if self.scene.robot.mount(link).length else 0.0
        return list(
            dict.fromkeys(
                name for a, b, name in self._of(link, radius)[1] if a + _EDGE < position < b - _EDGE
            )
        )

    def closed(self, link: str) -> tuple[float, float]:
        """Return the lowest and highest position at which a ring closes around ``link``.

        The whole width of the ring must lie in the usable part. If there is no such position, the
        first value exceeds the second.
        """
        mount, width = self.scene.robot.mount(link), self.scene.rules.band[1]
        if mount.length == 0:
            return 0.0, 0.0
        return mount.usable[0] + width / 2 / mount.length, mount.usable[
            1
        ] - width / 2 / mount.length

    def _of(self, link: str, radius: float) -> tuple[Stretches, Cuts]:
        key = (link, round(radius, _SAME))
        if key not in self._found:
            self._found[key] = self._look(link, radius)
        return self._found[key]

    def _look(self, link: str, radius: float) -> tuple[Stretches, Cuts]:
        """Return the clear intervals, and the obstructed ones with the names of their bodies."""
        length, half, arm = (
            self.scene.robot.mount(link).length,
            self.scene.rules.band[0] / 2,
            self.scene.rules.arm,
        )
        t, span, share = self._near(link), (-arm, length + arm), length or 1.0
        obstructed = blocked(capsule_gap(t.start, t.end, t.thick, radius), len(t.thick), span, half)
        obstructed += [
            (a, b, len(t.thick) + i)
            for a, b, i in blocked(plane_gap(t.normal, t.offset, radius), len(t.offset), span, half)
        ]
        cuts = [((a - arm) / share, (b + arm) / share, t.names[i]) for a, b, i in obstructed]
        return _left(self.closed(link), cuts), cuts

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
        most = max((len(o.body.offset) for o in self.scene.obstacles), default=1)
        count = len(self.scene.obstacles) * len(T)
        normal, offset = np.zeros((count, most, 3)), np.full((count, most), NOWHERE)
        for i, obstacle in enumerate(self.scene.obstacles):
            n, here = obstacle.body.normal, slice(i * len(T), (i + 1) * len(T))
            normal[here, : len(n)] = np.einsum("paj,mj->pma", turn, n)
            offset[here, : len(n)] = obstacle.body.offset - origin @ n.T
            names += [obstacle.name] * len(T)
        return _Things(start, end, thick, normal, offset, names)


def _left(span: tuple[float, float], cuts: Cuts) -> Stretches:
    """Return ``span`` less ``cuts``."""
    left, low = [], span[0]
    for a, b, _ in sorted(cuts):
        if a > low:
            left.append((low, min(a, span[1])))
        low = max(low, b)
        if low > span[1]:
            return [s for s in left if s[0] <= s[1]]
    left.append((low, span[1]))
    return [s for s in left if s[0] <= s[1]]
