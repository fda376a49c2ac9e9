"""What hides points from the sensors on one link.

All is in the coordinates of the link's mount, in which most bodies of the robot are at the same
place at many poses: the different places are stored once.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from ..occlusion.occluders import Occluders
from ..occlusion.occlusion_mode import Occlusion
from ..robots.robot import Mount
from ..solids.polyhedra import Polyhedron, crossing, placed
from ..solids.segments import inner, nearest_places
from .balls import STEPS
from .mount_points import MountPoints

# of its radius, length of the parts of a capsule in balls; most parts
_PART, _PARTS = 0.6, 24
_SAME = 9  # decimals of m to which places of bodies are the same
_HEIGHTS = 0.03  # m, between two heights
_OUTLOOK = 1 << 13  # points in one batch, so that their arrays stay in cache


@dataclass(frozen=True)
class LinkOccluders:
    """The occluders of P poses in the coordinates of a link's mount: U places of capsules."""

    start: Float[np.ndarray, "U 3"]
    """Start of each capsule's axis, m."""
    end: Float[np.ndarray, "U 3"]
    """End of each capsule's axis, m."""
    radius: Float[np.ndarray, " U"]
    """Radius of each capsule, m."""
    capsules: Int[np.ndarray, "P B"]
    """Index of each of the B capsules at each pose."""
    bodies: tuple[Polyhedron, ...]
    """Places of convex obstacles."""
    obstacles: Int[np.ndarray, "P O"]
    """Index of each of the O obstacles at each pose."""
    occlusion: Occlusion
    """The occlusion model."""

    @cached_property
    def balls(
        self,
    ) -> tuple[Float[np.ndarray, "Q 3"], Float[np.ndarray, " Q"], Int[np.ndarray, " U"]]:
        """Balls that hold the capsules: centres and radii, m, and the first ball of each."""
        way = self.end - self.start
        length = np.linalg.norm(way, axis=1)
        parts = np.ceil(length / np.maximum(_PART * self.radius, 1e-3)).astype(int)
        parts = np.clip(parts, 1, _PARTS)
        first = np.cumsum(parts) - parts
        body = np.repeat(np.arange(len(parts)), parts)
        at = (np.arange(len(body)) - first[body] + 0.5) / parts[body]
        centre = self.start[body] + at.astype(np.float32)[:, None] * way[body]
        return centre, (self.radius + length / (2 * parts))[body].astype(np.float32), first

    def clear(
        self,
        a: list[Float[np.ndarray, " T"]],
        u: list[Float[np.ndarray, " T"]],
        pose: Int[np.ndarray, " T"],
        beams: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None,
    ) -> Bool[np.ndarray, " T"]:
        """Return whether the segments from ``a`` by ``u``, coordinates (T,) in m, are clear.

        Args:
            a: starts of the segments.
            u: vectors to their ends.
            pose: pose of each segment.
            beams: which capsules (U, S) and obstacles (V, S) the beams of sensors may meet, and the
                sensor (T,) of each segment; None: any of them.
        """
        clear = np.ones(len(pose), bool)
        if beams is not None:
            body = self.capsules[pose if len(self.capsules) > 1 else np.zeros_like(pose)]  # (T, B)
            t, b = np.nonzero(beams[0][body, beams[2][:, None]])
            if len(t):
                hidden = self._behind_capsule(body[t, b], *([v.take(t) for v in w] for w in (a, u)))
                clear[t[hidden]] = False
        else:
            for column in self.capsules.T:
                self._hide(clear, column, self._behind_capsule, a, u, pose)
        for column in self.obstacles.T:
            self._hide(clear, column, self._behind_obstacle, a, u, pose, beams)
        return clear

    def _hide(
        self,
        clear: Bool[np.ndarray, " T"],
        column: Int[np.ndarray, " P"],
        hides: Callable[..., Bool[np.ndarray, " T"]],
        a: list[Float[np.ndarray, " T"]],
        u: list[Float[np.ndarray, " T"]],
        pose: Int[np.ndarray, " T"],
        beams: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None,
    ) -> None:
        """Clear the flags of segments that one body hides, whose index at each pose is
        ``column``."""
        body = column[pose] if len(column) > 1 else column[:1]
        some = np.flatnonzero(clear if beams is None else beams[1][body, beams[2]] & clear)
        if len(some):
            mine = body[some] if len(column) > 1 else body
            clear[some] = ~hides(mine, *([v[some] for v in w] for w in (a, u)))

    @cached_property
    def _axes(self) -> tuple[Float[np.ndarray, "3 U"], Float[np.ndarray, "3 U"]]:
        """Starts and ways of the capsules' axes, a row for each coordinate."""
        return np.ascontiguousarray(self.start.T), np.ascontiguousarray((self.end - self.start).T)

    def _behind_capsule(
        self, body: Int[np.ndarray, "*T"], a: list[np.ndarray], u: list[np.ndarray]
    ) -> Bool[np.ndarray, " T"]:
        """Return which of the segments from ``a`` by ``u`` come nearer to a capsule's axis than its
        radius."""
        start, w = ([row.take(body) for row in rows] for rows in self._axes)
        r = [v - c for v, c in zip(a, start, strict=True)]
        s, t = nearest_places(u, w, r)
        gap = [x + s * y - t * z for x, y, z in zip(r, u, w, strict=True)]
        hidden: np.ndarray = inner(gap, gap) < self.radius.take(body) ** 2
        return hidden

    def _behind_obstacle(
        self, body: Int[np.ndarray, "*T"], a: list[np.ndarray], u: list[np.ndarray]
    ) -> Bool[np.ndarray, " T"]:
        """Return which of the segments from ``a`` by ``u`` cross an obstacle."""
        hidden = np.zeros(len(u[0]), bool)
        for number in np.unique(body).tolist():
            mine = np.flatnonzero(np.broadcast_to(body == number, hidden.shape))
            planes = self.bodies[number]
            rise, steep = (
                sum(c * v[mine] for c, v in zip(planes.normal.T[..., None], w, strict=True))
                for w in (a, u)
            )
            enter, leave = crossing(rise - planes.offset[:, None], steep, np.float32(1), axis=0)
            hidden[mine] = enter < leave
        return hidden


def link_occluders(
    mount: Mount,
    frames: Float[np.ndarray, "P 4 4"],
    occluders: Sequence[Occluders],
    occlusion: Occlusion,
) -> LinkOccluders:
    """Return the occluders at P poses in the coordinates of a mount.

    Args:
        mount: the mount.
        frames: frame of the mount's link at each pose, T_base_frame.
        occluders: bodies and obstacles at each pose, base frame.
        occlusion: the model by which they occlude.
    """
    own = np.eye(4)
    own[:3, :3] = np.stack([mount.zero, mount.side, mount.axis])
    own[:3, 3] = -own[:3, :3] @ np.asarray(mount.start)
    capsules: list[np.ndarray] = []
    bodies, numbers = list[Polyhedron](), dict[bytes, int]()
    obstacles = []
    for frame, at in zip(frames, occluders, strict=True):
        T = own @ np.linalg.inv(frame)
        if at.bodies is not None:
            start, end = (
                np.asarray(a, float) @ T[:3, :3].T + T[:3, 3]
                for a in (at.bodies.start, at.bodies.end)
            )
            radius = np.broadcast_to(at.bodies.radius, len(start))
            capsules.append(np.column_stack([start, end, radius]))
        row = []
        for body in at.obstacles:
            moved = placed(body, T)
            key = np.round(np.column_stack([moved.normal, moved.offset]), _SAME).tobytes()
            if key not in numbers:
                numbers[key] = len(bodies)
                bodies.append(moved)
            row.append(numbers[key])
        obstacles.append(row)
    every = np.stack(capsules) if capsules else np.zeros((len(frames), 0, 7))
    flat = np.round(every.reshape(-1, 7), _SAME)
    some, which = np.unique(flat, axis=0, return_inverse=True)
    some = some.astype(np.float32)
    return LinkOccluders(
        some[:, :3],
        some[:, 3:6],
        some[:, 6],
        which.reshape(every.shape[:2]),
        tuple(bodies),
        np.array(obstacles, int).reshape(len(frames), -1),
        occlusion,
    )


class Outlook:
    """Guessed lines of sight from rings on one link to N points.

    The sensor that sees a point is the one nearest to it in azimuth. Whether bodies hide the point
    from that sensor depends mostly on the ring's height. The guess is the line of sight from the
    place on the ring's circle at the azimuth of the point, at the nearest of some heights.
    """

    def __init__(self, points: MountPoints, past: LinkOccluders, radius: float) -> None:
        """Store points and occluders in the coordinates of the link's mount, and the rings' radius,
        m."""
        self._points, self._past, self._radius = points, past, np.float32(radius)
        self._rows = dict[int, Bool[np.ndarray, " N"]]()

    def clear(
        self, height: Float[np.ndarray, " K"], index: Int[np.ndarray, " M"] | None = None
    ) -> Bool[np.ndarray, "K M"]:
        """Return whether rings at the heights (K,), m, probably have the points ``index``, by
        default all, in sight."""
        rows, which = np.unique(np.rint(height / _HEIGHTS).astype(int), return_inverse=True)
        each = [self._row(r) for r in rows.tolist()]
        clear: np.ndarray = np.stack([r if index is None else r.take(index) for r in each])[which]
        return clear

    def _row(self, row: int) -> Bool[np.ndarray, " N"]:
        if row not in self._rows:
            n = len(self._points.x)
            clear = np.zeros(n, bool)
            for k in range(0, n, _OUTLOOK):
                some = self._points.some(np.arange(k, min(k + _OUTLOOK, n)))
                apex = [
                    self._radius * np.cos(some.azimuth),
                    self._radius * np.sin(some.azimuth),
                    np.full(len(some.x), row * _HEIGHTS, np.float32),
                ]
                way = [v - a for v, a in zip((some.x, some.y, some.height), apex, strict=True)]
                clear[k : k + _OUTLOOK] = self._past.clear(apex, way, some.pose)
                if some.ball.any():
                    self._look_at_rims(clear[k : k + _OUTLOOK], some, apex, way)
            self._rows[row] = clear
        return self._rows[row]

    def _look_at_rims(
        self,
        clear: Bool[np.ndarray, " M"],
        some: MountPoints,
        apex: list[Float[np.ndarray, " M"]],
        way: list[Float[np.ndarray, " M"]],
    ) -> None:
        """Set the flags of points with a ball of which a place on the rim, across ``way``, is in
        sight."""
        level = np.stack([-np.sin(some.azimuth), np.cos(some.azimuth), 0 * some.azimuth])
        upward = np.cross(np.stack(way), level, axis=0)
        upward /= np.maximum(np.linalg.norm(upward, axis=0), np.float32(1e-9))
        for a, b in STEPS[1:]:
            m = np.flatnonzero(~clear & (some.ball > 0))
            rim = some.ball[m] * (a * level[:, m] + b * upward[:, m])
            ends = [w[m] + v for w, v in zip(way, rim, strict=True)]
            clear[m] = self._past.clear([v[m] for v in apex], ends, some.pose[m])
