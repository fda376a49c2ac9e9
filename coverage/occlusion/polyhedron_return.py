"""First return of a convex obstacle: the nearest point of a polyhedron inside a cone.

The point is the nearest of a few candidates, each of which has a closed form, that lie in both.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float

from ..arrays import Array, Numbers, cross, dot, namespace, root
from ..solids.cones import cone
from ..solids.polyhedra import Polyhedron
from .first_return import MARGIN, Beam

_CANDIDATES = 1 << 18  # points processed at once: some tens of megabytes
_NIL, _FAR = 1e-12, 1e9  # smallest divisor, and the quotient for smaller ones


def _over(a: Array, b: Array) -> Any:
    """Return ``a`` over ``b``; a large constant, with gradient 0, where ``b`` is almost 0."""
    xp = namespace(b)
    some = xp.abs(b) > _NIL
    return xp.where(some, a / xp.where(some, b, 1.0), _FAR)


def meeting_points(looks: Beam, body: Polyhedron) -> Any:
    """Return candidate points (K, N, 3) m for the first return of a polyhedron in each of K cones.

    If polyhedron and cone meet, one candidate is the point of their intersection nearest to the
    apex. The others may lie anywhere. NumPy, or JAX, which can differentiate them.

    The least distance to a convex set is attained where some of its bounds meet. On a face it is
    the apex's foot, the place where the cone's mantle leans most towards the face, the place
    nearest to the axis where the face meets the base's plane, or a place on the rim of the base.
    On an edge it is the apex's foot, an end, or a point where the edge enters the mantle or the
    base.
    """
    xp = namespace(looks.apex)
    apex, axis, half_angle, range_m = (a[:, None] for a in looks)
    normal, offset = body.normal[None], body.offset[None]
    cosine, sine = xp.cos(half_angle), xp.sin(half_angle)
    height = dot(apex, normal) - offset  # (K, F), from the face's plane
    aside = dot(axis, normal)[..., None] * axis - normal  # -normal less its part along the axis
    width = root(dot(aside, aside))
    aside = aside / xp.where(width > 0, width, 1.0)[..., None]
    look = cosine[..., None] * axis + sine[..., None] * aside
    # On the plane of the base, at ``aside`` times x from its middle, the face's plane is met at:
    middle = apex + range_m[..., None] * axis
    x = _over(dot(middle, normal) - offset, width)
    level = middle + x[..., None] * aside
    rim = root((range_m * sine / cosine) ** 2 - x * x)[..., None] * cross(axis, aside)
    on_mantle = apex - _over(height, dot(look, normal))[..., None] * look
    candidates = [apex - height[..., None] * normal, on_mantle, level, level + rim, level - rim]
    if len(body.edges):
        candidates += _on_edges(apex, axis, cosine, range_m, body)
    return xp.concatenate(candidates, axis=1)


def polyhedron_in_beam(
    looks: Beam, body: Polyhedron, margin: float = 0.0
) -> Float[np.ndarray, " K"]:
    """Return the distance (K,) m of a polyhedron's nearest point in each of K cones.

    It is infinite if they do not meet. The point is the nearest of ``meeting_points`` that lies in
    both. ``margin`` (m and rad) widens both. NumPy only.
    """
    each = 1 + _CANDIDATES // (5 * len(body.offset) + 7 * len(body.edges))
    if len(looks.apex) > each:
        some = [slice(i, i + each) for i in range(0, len(looks.apex), each)]
        return np.concatenate(
            [polyhedron_in_beam(Beam(*(a[k] for a in looks)), body, margin) for k in some]
        )
    looks = Beam(looks.apex, looks.axis, looks.half_angle + margin, looks.range_m + margin)
    body = replace(body, offset=body.offset + margin)
    points = meeting_points(looks, body)
    apex, axis, half_angle, range_m = (a[:, None] for a in looks)
    cosine, sine = np.cos(half_angle + MARGIN), np.sin(half_angle + MARGIN)
    in_cone = cone(points, apex, axis, cosine, sine, range_m) <= MARGIN
    v = points - apex
    distance = np.where(in_cone, np.sqrt(dot(v, v)), np.inf)
    # points outside one face need no test of the others
    for normal, offset in zip(body.normal, body.offset, strict=True):
        k, n = np.nonzero(np.isfinite(distance))
        distance[k, n] = np.where(
            dot(points[k, n], normal) <= offset + MARGIN, distance[k, n], np.inf
        )
    nearest: np.ndarray = distance.min(axis=1, initial=np.inf)
    return nearest


def _on_edges(
    apex: Array, axis: Array, cosine: Numbers, range_m: Numbers, body: Polyhedron
) -> list[Any]:
    """Return points (K, E, 3) on edges: the nearest to the apex, both ends, and the intersections.

    The intersections are those of the edge's line with mantle and base.
    """
    xp = namespace(apex)
    a, w = body.edges[None, :, 0], (body.edges[:, 1] - body.edges[:, 0])[None]
    v = a - apex
    along_v, along_w = dot(v, axis), dot(w, axis)
    vv, vw, ww = dot(v, v), dot(v, w), dot(w, w)
    square = cosine * cosine
    p, q, r = along_w**2 - square * ww, along_v * along_w - square * vw, along_v**2 - square * vv
    spread = root(q * q - p * r)
    places = [-vw / ww, xp.zeros_like(vw), xp.ones_like(vw), _over(range_m - along_v, along_w)]
    places += [_over(-q + spread, p), _over(-q - spread, p), _over(-r, 2 * q)]
    return [a + xp.clip(place, 0.0, 1.0)[..., None] * w for place in places]
