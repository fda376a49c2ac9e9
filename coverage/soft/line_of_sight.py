"""Soft lines of sight: how deep points lie behind bodies and obstacles, seen from sensors.

A point is hidden where the segment from the sensor's apex to it passes a body's axis more closely
than the body's radius. What it lacks is divided by the place along the segment where it passes,
which gives about the distance of the point from the shadow's surface. The sign is exact.

Of all bodies and planes only the one that hides a point deepest has a gradient. Which one that is,
and where the segment passes it, is found without one: these places minimise the distance.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial, reduce
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Float, Int

from ..arrays import Array, Numbers, root
from ..occlusion.occlusion_mode import Occlusion
from ..occlusion.unreported import inside, separations
from ..solids.beams import Beams, BeamShape
from ..solids.capsules import Capsules
from ..solids.cones import around
from ..solids.polyhedra import Polyhedron, polyhedron_shadow
from ..solids.segments import Coordinates, inner, nearest_places
from .first_return import of_each, soft_unreported

_NEAREST = 0.02  # least place along a segment, as a share: nearer to the apex nothing grows further


class Passing(NamedTuple):
    """Where segments from apexes to points pass the body that hides the points deepest."""

    place: Any
    """Place on the segment, as a share of it."""
    foot: Coordinates
    """Nearest place on the body's axis, m."""
    radius: Any
    """The body's radius, m."""


class Sight(NamedTuple):
    """What hides points from sensors, chosen without gradient."""

    passing: Passing | None
    """Of the bodies; None without."""
    planes: tuple[Any, ...]
    """Number of the deepest plane of each obstacle's shadow."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Occluding:
    """What occludes K sensors; batches are of mountings and poses."""

    bodies: Capsules | None = None
    """Bodies that cast shadows, one axis of capsules; None: there are none."""
    planes: tuple[tuple[Array, Array], ...] = ()
    """Normals (K, F, 3) and offsets (K, F) m of the shadow of each obstacle."""
    dark: Float[Array, "*batch K M 2"] | None = None
    """Intervals of the distance, m, in which sensors report nothing (see ``unreported``); they
    begin at infinity for multi-zone sensors. None: bodies take no targets."""

    def sight(self, sensor: Array, apex: Coordinates, points: Coordinates) -> Sight:
        """Return what hides points from sensors, by their numbers and apexes."""
        planes = tuple(_deepest_plane(sensor, points, *one) for one in self.planes)
        return Sight(None if self.bodies is None else _passing(apex, points, self.bodies), planes)

    def past(
        self, value: Array, sensor: Array, apex: Coordinates, points: Coordinates, sight: Sight
    ) -> Any:
        """Return the function of beams past the occluders from that without, m."""
        hidden = [
            -_above(normal, offset, sensor, points, plane)
            for (normal, offset), plane in zip(self.planes, sight.planes, strict=True)
        ]
        if sight.passing is not None:
            hidden.append(_depth(apex, points, sight.passing))
        if self.dark is None:
            return reduce(jnp.maximum, hidden, value)
        dark = jnp.moveaxis(self.dark[sensor], (-2, -1), (0, 1))
        blinded = jnp.isfinite(dark[0, 0]) & jnp.isinf(dark[0, 1])  # no shadow lies before
        for depth in hidden:
            value = jnp.where(blinded, value, jnp.maximum(value, depth))
        v = [p - a for p, a in zip(points, apex, strict=True)]
        away = root(inner(v, v))
        return reduce(jnp.maximum, (inside(away, *interval) for interval in dark), value)


def occluding(
    cones: Beams,
    bodies: Capsules | None,
    obstacles: Sequence[Polyhedron],
    occlusion: Occlusion,
    width: Numbers | None,
) -> Occluding:
    """Return what occludes sensors with given beams at one pose.

    Args:
        cones: the beams.
        bodies: bodies of the robot; None where they hide nothing.
        obstacles: other convex solids.
        occlusion: the model.
        width: width of the sigmoid, m; None: without first returns.
    """
    planes = tuple(of_each(partial(polyhedron_shadow, cones.apex), obstacles))
    separation = separations(cones, occlusion)
    if separation.shape[-1] == 0 or bodies is None:
        return Occluding(bodies, planes)
    looks = around(cones)
    # slopes of padding sensors would not be numbers
    range_m = jnp.where(looks.range_m > 0, looks.range_m, 1.0)
    dark = None
    if width is not None:
        looks = replace(looks, range_m=range_m)
        dark = soft_unreported(looks, bodies, tuple(obstacles), width, separation)
        dark = dark.at[..., 0].set(jnp.where(cones.is_zoned()[:, None], jnp.inf, dark[..., 0]))
    if isinstance(cones, BeamShape) and separation.shape[-1] == 1:  # all are blinded
        return Occluding(dark=dark)
    return Occluding(bodies, planes, dark)


def _passing(apex: Coordinates, points: Coordinates, bodies: Capsules) -> Passing:
    def deeper(body: Any, best: tuple[Any, Passing]) -> tuple[Any, Passing]:
        axis = [(bodies.start[body, i], bodies.end[body, i]) for i in range(3)]
        passing = _nearest(apex, points, axis, bodies.radius[body])
        depth = _depth(apex, points, passing)
        new: tuple[Any, Passing] = jax.tree.map(
            lambda a, b: jnp.where(depth > best[0], a, b), (depth, passing), best
        )
        return new

    nothing = jnp.zeros(jnp.broadcast_shapes(apex[0].shape, points[0].shape), apex[0].dtype)
    start = nothing - jnp.inf, Passing(nothing, (nothing, nothing, nothing), nothing)
    passing: Passing = jax.lax.fori_loop(0, len(bodies.radius), deeper, start)[1]
    return passing


def _nearest(
    apex: Coordinates, points: Coordinates, axis: list[tuple[Any, Any]], radius: Any
) -> Passing:
    """Return where segments from apexes to points pass the axis of a body most closely."""
    u = [p - a for p, a in zip(points, apex, strict=True)]
    v = [end - start for start, end in axis]
    w = [a - start for a, (start, _) in zip(apex, axis, strict=True)]
    place, along = nearest_places(u, v, w)
    x, y, z = (start + along * v[i] for i, (start, _) in enumerate(axis))
    return Passing(place, (x, y, z), radius)


def _depth(apex: Coordinates, points: Coordinates, passing: Passing) -> Any:
    """Return how deep points lie behind a body, about m, negative outside; see the module."""
    place = passing.place
    gap = [a + place * (p - a) - f for a, p, f in zip(apex, points, passing.foot, strict=True)]
    return (passing.radius - root(inner(gap, gap))) / jnp.maximum(place, _NEAREST)


def _above(normal: Array, offset: Array, sensor: Array, points: Coordinates, plane: Any) -> Any:
    """Return the distance of points from planes of a solid's shadow, m."""
    return inner(points, jnp.moveaxis(normal[sensor, plane], -1, 0)) - offset[sensor, plane]


def _deepest_plane(
    sensor: Int[Array, "*shape"], points: Coordinates, normal: Array, offset: Array
) -> Int[Array, "*shape"]:
    """Return the number of the plane above which each point lies highest."""

    def higher(plane: Any, best: tuple[Any, Any]) -> tuple[Any, Any]:
        value = _above(normal, offset, sensor, points, plane)
        more = value > best[0]
        return jnp.where(more, value, best[0]), jnp.where(more, plane, best[1])

    nothing = jnp.full(sensor.shape, -jnp.inf, normal.dtype), jnp.zeros(sensor.shape, jnp.int32)
    highest: Array = jax.lax.fori_loop(0, offset.shape[1], higher, nothing)[1]
    return highest
