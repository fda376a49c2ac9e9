"""Distances at which a single-zone sensor cannot report a thing, because of bodies in its beam.

A sensor that measures one distance for its whole beam may report several targets, one behind the
other, if they are far enough apart. Let the bodies that meet the beam be numbered by the distances
``near`` of their first returns, and let ``far`` be the distance from the apex beyond which nothing
of a body lies, in the beam or outside it. Then a thing at distance d is reported if

* for each body, d < near, or d >= far + separation: whatever part of the body the sensor sees, its
  return is farther away, or nearer by at least the separation. A nearer thing that merges with a
  body is the start of the merged return, whose distance is reported;
* fewer bodies than the sensor has targets have near <= d. Each body takes one target, even where
  bodies merge, and the sensor reports the nearest targets.

A sensor of one target thus sees nothing beyond its first return: ``blind``. Occluded points count
as not covered, too. All bounds of the definition err towards not covered: a body may reach less far
inside the beam than outside, and merged bodies share a target. More targets or a smaller separation
never cover less.
"""

from typing import Any

from jaxtyping import Float

from ..arrays import Array, Numbers, dot, namespace, root
from ..solids.beams import Beams
from ..solids.polyhedra import Polyhedron
from .occlusion_mode import REPORTING, Occlusion


def separations(beams: Beams, occlusion: Occlusion) -> Float[Array, "K R"]:
    """Return the separations (K, R) m behind the first R bodies in beams: infinite behind the one
    that takes the last target; R is 0 for models in which bodies take no targets."""
    xp = namespace(beams.half_angle)
    if occlusion == "returns" and beams.separation is not None:
        own: Array = beams.separation
        return own
    last: Array = xp.full((len(beams), int(occlusion in REPORTING)), xp.inf)
    return last


def unreported(
    near: Float[Array, "*batch N"],
    far: Float[Array, "*batch N"],
    separation: Float[Array, "*sensors R"],
) -> Float[Array, "*batch M 2"]:
    """Return the least distances and the ends of M <= N, R intervals in which nothing is reported.

    The intervals may overlap. In JAX the order of the bodies has no gradient.

    Args:
        near: distances of the first returns of N bodies, m; infinite for bodies not in the beam.
        far: distances beyond which nothing of the bodies lies, m.
        separation: see ``separations``.
    """
    xp = namespace(near)
    if separation.shape[-1] == 1 and near.shape[-1]:  # quicker
        order = near.argmin(axis=-1)[..., None]
    else:
        order = xp.argsort(near, axis=-1)[..., : separation.shape[-1]]
    start, end = (xp.take_along_axis(a, order, axis=-1) for a in (near, far))
    intervals: Array = xp.stack([start, end + separation[..., : start.shape[-1]]], axis=-1)
    return intervals


def inside(away: Array, start: Numbers, end: Numbers) -> Any:
    """Return how deep distances lie in intervals, m, negative outside; 1-Lipschitz."""
    return namespace(away).minimum(away - start, end - away)


def capsule_end(apex: Array, start: Array, end: Array, radius: Numbers) -> Any:
    """Return the distance (...) m of the farthest point of capsules from apexes (..., 3) m."""
    xp = namespace(apex)
    a, b = (root(dot(v, v)) for v in (start - apex, end - apex))
    return xp.maximum(a, b) + radius


def polyhedron_end(apex: Float[Array, "*batch 3"], body: Polyhedron) -> Any:
    """Return the distance (...) m of the farthest point of a solid, infinite for a half-space."""
    xp = namespace(apex)
    if not len(body.edges):
        return xp.full(apex.shape[:-1], xp.inf, apex.dtype)
    corners = body.edges.reshape(*[1] * (apex.ndim - 1), -1, 3)
    v = corners - apex[..., None, :]
    return root(dot(v, v).max(axis=-1))
