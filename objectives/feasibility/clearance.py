"""Where on each link a real ring is clear: closed around the link, in no body and no obstacle at
any pose of the scene.

A ring's body is a band about its circle: all points within half its thickness of the circle's
copies along the axis, so that its width is kept. It is clear at a position where the circle is
clear, by half the thickness, all along the band: one function of one place, which
``circle_clearance`` bounds from below. The sensors' apexes lie on the circle, and are clear with
it.
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

_SAME = 9  # decimals of a metre: bodies that lie alike at two poses are looked at once
# m, by which a radius that is not stated may be raised to be clear
_MORE = tuple(0.005 * i for i in range(11))
_ENOUGH = 0.01  # m of a link
_NAMED = 3  # things in the way, at most
_EDGE = 1e-8  # of a link: a ring at the very end of what is clear is clear
Stretches = list[tuple[float, float]]
Cuts = list[tuple[float, float, str]]


@dataclass(frozen=True)
class _Things:
    """Capsules (start, end (C, 3), thick (C,)) and convex bodies (normal (P, M, 3), offset (P, M))
    in a mount's axis coordinates, m, and the names of all."""

    start: Float[np.ndarray, "C 3"]
    end: Float[np.ndarray, "C 3"]
    thick: Float[np.ndarray, " C"]
    normal: Float[np.ndarray, "P M 3"]
    offset: Float[np.ndarray, "P M"]
    names: list[str]


class MountClearance:
    """Where rings of a scene are clear; what was asked once is kept."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.frames = forward(scene.robot.chain, np.array([p.q for p in scene.poses]))
        self._things: dict[str, _Things] = {}
        self._found: dict[tuple[str, float], tuple[Stretches, Cuts]] = {}

    def stretches(self, link: str, radius: float) -> Stretches:
        """Positions, low and high, between which a ring of ``radius`` m on ``link`` is clear; all
        of them, but for a fraction of a millimetre at each end."""
        return self._of(link, radius)[0]

    def radius(self, link: str, at_least: float = 0.0) -> float:
        """The radius of a new ring on ``link``, m: the scene's, or ``at_least``. One that is not
        stated is the least that is clear over a centimetre or, of radii up to 5 cm larger than
        needed, over the longest stretch."""
        first = max(self.scene.radius_of(link), at_least)
        if self.scene.stated_radius(link) is not None:
            return first
        found, enough = (-1.0, first), min(_ENOUGH, self.scene.robot.mount(link).length)
        for more in _MORE:
            radius = round(first + more, 4)
            stretches = self.stretches(link, radius)
            length = (
                sum(b - a for a, b in stretches) * self.scene.robot.mount(link).length
                if stretches
                else -1.0
            )
            if length > found[0]:
                found = (length, radius)
            if length >= enough:
                break
        return found[1]

    def why(self, link: str, radius: float) -> str:
        """What leaves no place to a ring of ``radius`` m on ``link``, or less place, in words; none
        where nothing does.
        """
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
        """The names of what a ring at ``position`` lies in at some pose, or comes nearer to than is
        proven clear; where the place along the axis is fixed, a position says nothing."""
        position = position if self.scene.robot.mount(link).length else 0.0
        return list(
            dict.fromkeys(
                name for a, b, name in self._of(link, radius)[1] if a + _EDGE < position < b - _EDGE
            )
        )

    def closed(self, link: str) -> tuple[float, float]:
        """The lowest and the highest position at which a ring can be closed around ``link`` with
        all of its width; the lower is first unless there is none."""
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
        """Positions that are clear, and those that are not, with the names of what is there."""
        length, half, arm = (
            self.scene.robot.mount(link).length,
            self.scene.rules.band[0] / 2,
            self.scene.rules.arm,
        )
        t, span, share = self._near(link), (-arm, length + arm), length or 1.0
        found = blocked(capsule_gap(t.start, t.end, t.thick, radius), len(t.thick), span, half)
        found += [
            (a, b, len(t.thick) + i)
            for a, b, i in blocked(plane_gap(t.normal, t.offset, radius), len(t.offset), span, half)
        ]
        cuts = [((a - arm) / share, (b + arm) / share, t.names[i]) for a, b, i in found]
        return _left(self.closed(link), cuts), cuts

    def _near(self, link: str) -> _Things:
        if link not in self._things:
            self._things[link] = self._gathered(link)
        return self._things[link]

    def _gathered(self, link: str) -> _Things:
        robot, mount = self.scene.robot, self.scene.robot.mount(link)
        T, axes = self.frames[:, mount.frame], axes_of(mount)
        turn = np.einsum("ak,pjk->paj", axes, T[:, :3, :3])  # of the base frame to axis coordinates
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
    """What ``cuts`` leave of ``span``."""
    left, low = [], span[0]
    for a, b, _ in sorted(cuts):
        if a > low:
            left.append((low, min(a, span[1])))
        low = max(low, b)
        if low > span[1]:
            return [s for s in left if s[0] <= s[1]]
    left.append((low, span[1]))
    return [s for s in left if s[0] <= s[1]]
