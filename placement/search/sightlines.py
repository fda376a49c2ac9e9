"""Lines of sight of the sensors of one kind on a link, tested exactly for pairs of a sensor and a
point.

For each sensor, bodies that its beam cannot meet are discarded first, by balls about parts of them.
"""

import math

import numpy as np
from jaxtyping import Bool, Float, Int

from ...coverage.occlusion.ball_in_cone import ball_in_cone
from ...coverage.occlusion.first_return import Beam, polyhedron_in_beam
from ...coverage.occlusion.occluders import INSIDE
from ...coverage.sensors.sensor import Sensor
from ...coverage.solids.polyhedra import Polyhedron
from ...coverage.solids.segments import from_segment
from .line_of_sight import LinkOccluders
from .mount_points import MountPoints

_SLACK = 1e-4  # m, for rounding in the test of balls
_WIDE = 1.4  # rad, half angle above which a beam is taken to meet everything
_FIRST, _NEXT = 16, 8  # places along a capsule at which its first return is sought, two times


class Sightlines:
    """Lines of sight of S sensors of one kind."""

    def __init__(
        self,
        among: LinkOccluders,
        apex: Float[np.ndarray, "S 3"],
        look: Float[np.ndarray, "S 3"],
        sensor: Sensor,
    ) -> None:
        """Find what each sensor's beam may meet."""
        self._among, self._apex = among, apex
        half = math.pi if sensor.thickness is not None else sensor.circumscribed_half_angle
        if sensor.shape == "dome" and sensor.half_angle > _WIDE:
            half = math.pi
        centre, ball, first = among.balls
        meets = _balls_meet(apex, look, half, sensor.range_m, centre, ball)  # (Q, S)
        self._meets = meets[: len(first)]  # (U, S)
        if len(first):
            self._meets = np.logical_or.reduceat(meets, first, axis=0)
        self._met = _obstacles_met(among.bodies, apex, look, half, sensor.range_m)  # (V, S)
        self._any = np.any(self._meets, axis=0) | np.any(self._met, axis=0)  # (S,)
        within = _within(among, apex)  # (U, S)
        inside = [np.asarray(b(apex.astype(float))) <= INSIDE for b in among.bodies]
        self._dead = None  # (P, S)
        if within.any() or np.any(inside):
            dead = within[among.capsules].any(axis=1)
            for column in among.obstacles.T:
                dead = dead | np.stack([inside[i] for i in column])
            self._dead = dead if dead.any() else None
        self._stop = None
        if among.blinding and not sensor.zoned:
            self._stop = self._stops(look, half, sensor.range_m)  # (P, S)

    def _stops(self, look: np.ndarray, half: float, range_m: float) -> Float[np.ndarray, "P S"]:
        """Return the distance of the first return of each sensor at each pose, m."""
        among, apex = self._among, self._apex
        first = np.full(self._meets.shape, np.inf, np.float32)  # (U, S)
        u, s = np.nonzero(self._meets)
        first[u, s] = _first_returns(
            apex[s], look[s], half, range_m, among.start[u], among.end[u], among.radius[u]
        )
        stop: np.ndarray = first[among.capsules].min(axis=1, initial=np.inf)  # (P, S)
        for body, column in enumerate(self._met):
            some = np.flatnonzero(column)
            if not len(some):
                continue
            beam = Beam(
                *(a[some].astype(float) for a in (apex, look)),
                *(np.full(len(some), a) for a in (half, range_m)),
            )
            distance = np.full(len(apex), np.inf)
            distance[some] = polyhedron_in_beam(beam, among.bodies[body])
            here = (among.obstacles == body).any(axis=1)
            stop[here] = np.minimum(stop[here], distance)
        return stop

    def clear(
        self, s: Int[np.ndarray, " T"], points: MountPoints, n: Int[np.ndarray, " T"]
    ) -> Bool[np.ndarray, " T"]:
        """Return whether sensor ``s`` has a line of sight to the point ``n`` in its beam."""
        among, pose = self._among, points.pose.take(n)
        clear = np.ones(len(s), bool)
        if self._dead is not None:
            clear &= ~self._dead[pose, s]
        a = [row.take(s) for row in self._apex.T]
        u = [v.take(n) - w for v, w in zip((points.x, points.y, points.height), a, strict=True)]
        if self._stop is not None:
            stop = self._stop[pose, s]
            clear &= u[0] * u[0] + u[1] * u[1] + u[2] * u[2] <= stop * stop
            return clear
        some = np.flatnonzero(clear & self._any.take(s))
        if len(some):
            a, u = ([v.take(some) for v in w] for w in (a, u))
            s, pose = s.take(some), pose.take(some)
            clear[some] = among.clear(a, u, pose, (self._meets, self._met, s))
        return clear


def _balls_meet(
    apex: Float[np.ndarray, "S 3"],
    look: Float[np.ndarray, "S 3"],
    half: float,
    range_m: float,
    centre: Float[np.ndarray, "Q 3"],
    radius: Float[np.ndarray, " Q"],
) -> Bool[np.ndarray, "Q S"]:
    """Return which balls the cones of sensors may meet."""
    if half > _WIDE:
        return np.ones((len(centre), len(apex)), bool)
    along = centre @ look.T - np.einsum("sc,sc->s", apex, look)  # (Q, S)
    square = (centre**2).sum(axis=1)[:, None] + (apex**2).sum(axis=1) - 2 * centre @ apex.T
    across = np.sqrt(np.maximum(square - along * along, 0.0))
    reach = radius[:, None] + np.float32(_SLACK)
    meets: np.ndarray = across * np.float32(math.cos(half)) <= reach + along * np.float32(
        math.sin(half)
    )
    meets &= (along >= -reach) & (along <= range_m + reach)
    return meets


def _obstacles_met(
    bodies: tuple[Polyhedron, ...], apex: np.ndarray, look: np.ndarray, half: float, range_m: float
) -> Bool[np.ndarray, "V S"]:
    """Return which obstacles each beam may meet; all of those without edges."""
    met = np.ones((len(bodies), len(apex)), bool)
    for i, body in enumerate(bodies):
        corners = np.asarray(body.edges).reshape(-1, 3)
        if len(corners):
            centre = corners.mean(axis=0)
            ball = np.linalg.norm(corners - centre, axis=1).max(keepdims=True)
            met[i] = _balls_meet(
                apex, look, half, range_m, *(a.astype(np.float32) for a in (centre[None], ball))
            )
    return met


def _within(among: LinkOccluders, apex: Float[np.ndarray, "S 3"]) -> Bool[np.ndarray, "U S"]:
    """Return which apexes lie in each capsule."""
    start, way = among.start[:, None], (among.end - among.start)[:, None]
    gap = np.asarray(from_segment(apex[None], start, start + way))
    within: np.ndarray = (gap * gap).sum(axis=-1) <= (among.radius[:, None] + INSIDE) ** 2
    return within


def _first_returns(
    apex: np.ndarray,
    look: np.ndarray,
    half: float,
    range_m: float,
    start: np.ndarray,
    end: np.ndarray,
    radius: np.ndarray,
) -> Float[np.ndarray, " T"]:
    """Return the distance of the nearest point of each capsule in each beam, m; else infinity.

    A capsule is a union of balls, and that point of a ball has a closed form. It is sought among
    balls at places along the axis, and once more about the nearest of them.
    """
    way, places = (end - start)[:, None], np.linspace(0, 1, _FIRST, dtype=np.float32)
    places = np.broadcast_to(places, (len(apex), _FIRST))
    step, least = np.float32(1 / (_FIRST - 1)), np.full(len(apex), np.inf, np.float32)
    for _ in range(2):
        nearest = ball_in_cone(
            apex[:, None],
            look[:, None],
            np.asarray(half, np.float32),
            np.asarray(range_m, np.float32),
            start[:, None] + places[..., None] * way,
            radius[:, None],
        )
        distance: np.ndarray = np.asarray(nearest[0])
        best = distance.argmin(axis=1)
        least = np.minimum(least, np.take_along_axis(distance, best[:, None], 1)[:, 0])
        about = np.take_along_axis(places, best[:, None], 1)
        places = np.clip(about + step * np.linspace(-1, 1, _NEXT + 1, dtype=np.float32), 0, 1)
    return least
