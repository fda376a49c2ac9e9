"""Lines of sight of the sensors of one kind on a link, tested exactly for pairs of a sensor and a
point.

For each sensor, bodies that its beam cannot meet are discarded first, by balls about parts of them.
"""

import math

import numpy as np
from jaxtyping import Bool, Float, Int

from ..occlusion.first_return import Beam, capsule_in_beam
from ..occlusion.occluders import INSIDE
from ..occlusion.occlusion_mode import REPORTING
from ..occlusion.polyhedron_return import polyhedron_in_beam
from ..occlusion.unreported import capsule_end, polyhedron_end, unreported
from ..sensors.sensor import Sensor
from ..solids.capsules import Capsules
from ..solids.polyhedra import Polyhedron
from .line_of_sight import LinkOccluders
from .mount_points import MountPoints

_SLACK = 1e-4  # m, for rounding in the test of balls
# m and rad: a body this near to a beam counts as in it, so that rounding a setup costs no target
GRAZE = 1e-4
_WIDE = 1.4  # rad, half angle above which a beam is taken to meet everything


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
        half = sensor.outer_angle
        centre, ball, first = among.balls
        meets = _balls_meet(apex, look, half, sensor.range_m, centre, ball)  # (Q, S)
        self._meets = meets[: len(first)]  # (U, S)
        if len(first):
            self._meets = np.logical_or.reduceat(meets, first, axis=0)
        self._met = _obstacles_met(among.bodies, apex, look, half, sensor.range_m)  # (V, S)
        self._any = np.any(self._meets, axis=0) | np.any(self._met, axis=0)  # (S,)
        bodies = Capsules(*(a[:, None] for a in (among.start, among.end, among.radius)))
        within = np.asarray(bodies.distance(apex[None])) <= INSIDE  # (U, S)
        inside = [np.asarray(b(apex.astype(float))) <= INSIDE for b in among.bodies]
        self._dead = None  # (P, S)
        if within.any() or np.any(inside):
            dead = within[among.capsules].any(axis=1)
            for column in among.obstacles.T:
                dead = dead | np.stack([inside[i] for i in column])
            self._dead = dead if dead.any() else None
        self._dark, self._shaded = None, True
        if among.occlusion in REPORTING and not sensor.zoned:
            own = sensor.separations if among.occlusion == "returns" else (math.inf,)
            self._dark = self._unreported(look, half, sensor.range_m, np.array(own, np.float32))
            self._shaded = len(own) > 1

    def _unreported(
        self, look: np.ndarray, half: float, range_m: float, separation: Float[np.ndarray, " R"]
    ) -> Float[np.ndarray, "P S M 2"]:
        """Return the intervals, m, in which each sensor reports nothing at each pose."""
        among, apex = self._among, self._apex
        first = np.full(self._meets.shape, np.inf, np.float32)  # (U, S)
        u, s = np.nonzero(self._meets)
        wide, far = (np.full(len(s), a, np.float32) for a in (half, range_m))
        beam, ends = Beam(apex[s], look[s], wide, far), (among.start[u], among.end[u])
        first[u, s] = capsule_in_beam(beam, *ends, among.radius[u], GRAZE, 1)[0]
        end = capsule_end(apex, *(a[:, None] for a in (among.start, among.end, among.radius)))
        each = [(first, end, among.capsules)]
        if len(among.bodies):
            first = np.full(self._met.shape, np.inf, np.float32)  # (V, S)
            for body, some in enumerate(map(np.flatnonzero, self._met)):
                beam = Beam(
                    *(a[some].astype(float) for a in (apex, look)),
                    *(np.full(len(some), a) for a in (half, range_m)),
                )
                first[body, some] = polyhedron_in_beam(beam, among.bodies[body], GRAZE)
            end = np.stack([polyhedron_end(apex, body) for body in among.bodies])
            each.append((first, end, among.obstacles))
        near, far = (
            np.concatenate([column[i][column[2]] for column in each], axis=1) for i in (0, 1)
        )  # (P, N, S)
        near, far = np.moveaxis(near, 1, 2), np.moveaxis(far + np.float32(GRAZE), 1, 2)
        return np.asarray(unreported(near, far, separation))

    def clear(
        self,
        s: Int[np.ndarray, " T"],
        points: MountPoints,
        n: Int[np.ndarray, " T"],
        moved: Float[np.ndarray, "T 3"] | None = None,
    ) -> Bool[np.ndarray, " T"]:
        """Return whether sensor ``s`` has a line of sight to the point ``n`` in its beam, or to one
        that lies ``moved`` m from it."""
        among, pose = self._among, points.pose.take(n)
        clear = np.ones(len(s), bool)
        if self._dead is not None:
            clear &= ~self._dead[pose, s]
        a = [row.take(s) for row in self._apex.T]
        u = [v.take(n) - w for v, w in zip((points.x, points.y, points.height), a, strict=True)]
        if moved is not None:
            u = [v + w for v, w in zip(u, moved.T, strict=True)]
        if self._dark is not None:
            square = u[0] * u[0] + u[1] * u[1] + u[2] * u[2]
            for start, end in np.moveaxis(self._dark[pose, s], (1, 2), (0, 1)):
                clear &= (square <= start * start) | (square >= end * end)
            if not self._shaded:
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
