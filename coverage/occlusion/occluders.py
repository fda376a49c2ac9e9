"""The occluders of a robot at one pose, and the visible parts of beams among them.

Bodies in the beam of a single-zone sensor take its targets under ``returns`` and ``blind``; see
``unreported``. For a sensor with a square beam the circumscribed cone is tested, so that a body
takes a target slightly too early, never too late. Each zone of a multi-zone sensor reports its own
targets. A body in some zones does not affect the others, so for such a beam both models are the
same as ``shadow``.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from ..arrays import Index, dot
from ..solids.base import Parts
from ..solids.beams import Beams
from ..solids.capsule_shadows import capsule_shadow
from ..solids.capsules import Capsules, gap_to_capsules
from ..solids.cones import around
from ..solids.polyhedra import Polyhedron, polyhedron_shadow
from .first_return import COARSE, MARGIN, Beam, capsule_gap, capsule_in_beam, cone_gap
from .occluded_beams import OccludedBeams
from .occlusion_mode import Occlusion
from .polyhedron_return import polyhedron_in_beam
from .shadows import CapsuleShadows, PolyhedronShadows, Shadows, first_of_sensors
from .unreported import capsule_end, polyhedron_end, separations, unreported

_BALL_MARGIN = 1e-5  # m, more than the margins of the tests that follow
INSIDE = 1e-6  # m, an apex this near to a body's surface counts as inside


@dataclass(frozen=True)
class Occluders:
    """Occluders at one pose."""

    bodies: Capsules | None = None
    """The robot's bodies, N capsules; None if they do not occlude."""
    obstacles: tuple[Polyhedron, ...] = ()
    """Convex obstacles."""

    def holds(
        self, apex: Float[np.ndarray, "K 3"]
    ) -> tuple[Int[np.ndarray, " K"], Float[np.ndarray, " K"]]:
        """Return the body or obstacle (K,) in which each apex lies deepest, and the depth (K,) m.

        Bodies are numbered first, then obstacles; -1: inside none.
        """
        gaps: list[np.ndarray] = [np.full((len(apex), 1), np.inf)]
        if self.bodies is not None:
            start, end, radius = (a[None] for a in self.bodies.arrays())
            each = [
                gap_to_capsules(apex, start[:, [i]], end[:, [i]], radius[:, [i]])
                for i in range(radius.shape[1])
            ]
            gaps.append(np.stack(each, axis=-1))
        gaps += [np.asarray(body(apex))[:, None] for body in self.obstacles]
        gap = np.concatenate(gaps[1:] or gaps, axis=1)
        least = gap.min(axis=1)
        return np.where(least <= INSIDE, gap.argmin(axis=1), -1), np.maximum(-least, 0.0)


def beams(
    cones: Beams,
    occluders: Occluders,
    occlusion: Occlusion,
    bracketed: bool = False,
    looks: Beams | None = None,
) -> Parts:
    """Return the visible parts of ``cones`` under ``occlusion``; the cones if nothing occludes.

    ``ignore`` ignores the robot only: obstacles then still cast shadows. Obstacles take targets as
    the robot does. A sensor inside a body sees nothing. Multi-zone sensors have shadows only, under
    ``returns`` and ``blind`` too.

    Args:
        cones: beams of K sensors, 64-bit NumPy.
        occluders: bodies and obstacles at the same pose.
        occlusion: the model; ``ignore`` omits the robot's bodies.
        bracketed: whether to keep bounds of the first returns, for the certified rule.
        looks: cones (K,); what meets them casts shadows. None: the circumscribed cones.
    """
    bodies = occluders.bodies if occlusion != "ignore" else None
    occluders = Occluders(bodies, occluders.obstacles)
    if bodies is None and not occluders.obstacles:
        return cones
    within_, _ = occluders.holds(np.asarray(cones.apex))
    live = within_ < 0
    cones = replace(cones, range_m=np.where(live, cones.range_m, -np.inf))
    separation = np.asarray(separations(cones, occlusion))
    one_zone = live & ~np.asarray(cones.is_zoned())
    dark, late = _dark(cones, np.flatnonzero(one_zone), occluders, separation, bracketed)
    # beyond the first return of one target there is no shadow left to cast
    blinded = one_zone & np.isinf(separation[:, :1]).any(axis=1)
    shadows = _shadows(cones, np.flatnonzero(live & ~blinded), occluders, looks or around(cones))
    return OccludedBeams(cones, dark, late, shadows)


def _looks(looks: Beams, k: Index) -> Beam:
    """Return the cones ``k`` (K,) of ``looks``."""
    return Beam(*(np.asarray(getattr(looks, name))[k] for name in Beam._fields))


def _near(looks: Beam, bodies: Capsules | None) -> Bool[np.ndarray, "K N"]:
    """Return which bodies meet each of the cones ``looks``, and a few that pass by within some
    thousandths of their axes."""
    if bodies is None:
        return np.zeros((len(looks.apex), 0), bool)
    start, end, radius = bodies.start, bodies.end, bodies.radius  # (N, 3), (N, 3), (N,)
    way = (end - start) / 2
    half = np.sqrt(dot(way, way))
    ball = half + radius + _BALL_MARGIN
    away = cone_gap(Beam(*(a[:, None] for a in looks)), (start + way)[None])  # (K, N)
    near: np.ndarray = away <= ball
    k, n = np.nonzero(near)
    each = Beam(*(a[k] for a in looks))
    gap = capsule_gap(each, start[n], end[n], radius[n], _BALL_MARGIN, rounds=1)[0]
    near[k, n] = gap <= 2 * COARSE * half[n]
    return near


def _first_returns(
    looks: Beam, occluders: Occluders, near: Bool[np.ndarray, "K N"], margin: float
) -> Any:
    """Return the distance (K, N + O) m of the first return of each body and obstacle in each beam;
    infinity where there is none.

    Args:
        looks: the beams.
        occluders: bodies and obstacles.
        near: the bodies that may meet each beam.
        margin: m and rad, by which beams and occluders are widened.
    """
    bodies = np.full(near.shape, np.inf)
    if occluders.bodies is not None:
        k, n = np.nonzero(near)
        each, (start, end, radius) = Beam(*(a[k] for a in looks)), occluders.bodies.arrays()
        bodies[k, n] = capsule_in_beam(each, start[n], end[n], radius[n], margin)[0]
    return np.concatenate([bodies, _in_obstacles(looks, occluders, margin)], axis=1)


def _in_obstacles(looks: Beam, occluders: Occluders, margin: float) -> Any:
    """Return the distance (K, O) m of each obstacle's first return in each beam, else infinity."""
    each = [polyhedron_in_beam(looks, body, margin) for body in occluders.obstacles]
    return np.stack(each, axis=1) if each else np.full((len(looks.apex), 0), np.inf)


def _dark(
    cones: Beams,
    k: np.ndarray,
    occluders: Occluders,
    separation: Float[np.ndarray, "K R"],
    bracketed: bool,
) -> tuple[Any, Any]:
    """Return the intervals (K, M, 2) m in which the sensors ``k`` report nothing; see
    ``unreported``.

    The first are bounds from outside and the second from inside if bracketed, else the same array.
    """
    if len(k) == 0 or separation.shape[1] == 0:
        none = np.zeros((len(cones), 0, 2))
        return none, none
    looks, each = _looks(around(cones), k), []
    near, far = _near(looks, occluders.bodies), _ends(np.asarray(looks.apex), occluders)
    for margin in (MARGIN, -MARGIN) if bracketed else (0.0,):
        first = _first_returns(looks, occluders, near, margin)
        own = unreported(first - margin, far + margin, separation[k])
        dark = np.full((len(cones), *own.shape[1:]), np.inf)
        dark[k] = own
        each.append(dark)
    return each[0], each[-1]


def _ends(apex: Float[np.ndarray, "K 3"], occluders: Occluders) -> Float[np.ndarray, "K N"]:
    """Return the distances beyond which nothing of each body and obstacle lies, m."""
    ends = [polyhedron_end(apex, body)[:, None] for body in occluders.obstacles]
    if occluders.bodies is not None:
        ends.insert(0, capsule_end(apex[:, None], *occluders.bodies.arrays()))
    return np.concatenate(ends, axis=1)


def _shadows(
    cones: Beams, k: np.ndarray, occluders: Occluders, looks: Beams
) -> tuple[Shadows, ...]:
    """Return the shadows in beams ``k`` of what meets their cones ``looks``."""
    if len(k) == 0:
        return ()
    in_cones, bodies, apex = _looks(looks, k), occluders.bodies, np.asarray(cones.apex)[k]
    meets = _near(in_cones, bodies)
    met = np.isfinite(_in_obstacles(in_cones, occluders, 10 * MARGIN))
    # no cone holds the beams of these: they take the shadows of everything
    every = np.asarray(cones.is_wide())[k]
    meets[every], met[every] = True, True
    shadows: list[Shadows] = []
    if bodies is not None:
        sensor, body = np.nonzero(meets)
        ends = bodies.start[body], bodies.end[body], bodies.radius[body]
        first = first_of_sensors(k[sensor], len(cones))
        shadows.append(CapsuleShadows(first, capsule_shadow(apex[sensor], *ends)))
    if occluders.obstacles:
        planes = [polyhedron_shadow(apex, body) for body in occluders.obstacles]
        first = first_of_sensors(k[np.nonzero(met)[0]], len(cones))
        shadows.append(PolyhedronShadows.of(met, first, planes))
    return tuple(shadows)
