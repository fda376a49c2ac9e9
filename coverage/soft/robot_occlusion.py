"""Occlusion of beams by the robot's bodies, for the soft estimator.

Under ``shadow``, a beam's function is the maximum of the cone's function and of minus that of each
shadow in it (``shadows``). Only the bodies near a cone are evaluated, and only at the blocks of
points that their shadows reach. At each point, only the shadow that attains the maximum has a
slope.

Under ``blind``, the beam of a single-zone sensor ends at the first return in it, or in the
circumscribed cone of a square beam (``first_return``). A multi-zone sensor is not blinded as a
whole: under ``blind`` its beam has shadows.

A sensor inside a body sees nothing, and the slope there only points out of the body.
"""

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp

from ..arrays import Array, Index, Numbers, dot, root
from ..occlusion.first_return import Beam, capsule_gap
from ..occlusion.occlusion_mode import Occlusion
from ..solids.capsule_shadows import capsule_shadow, nearest_ball
from ..solids.capsules import Capsules
from ..solids.cones import Cones
from ..solids.polyhedra import Polyhedron
from ..solids.segments import from_segment
from ..solids.sensor_beams import MixedBeams
from .beams import soft_beams
from .cones import Near, SoftBeams, by_apex
from .first_return import soft_stop

# metres by which a beam is moved away from all points, per metre that its apex lies within a body
_OUT = 10.0
_STEPS = 18  # to find the place on a body's axis that is nearest to a cone
_NEAR = 3.0  # widths from a shadow within which it matters to a block
_PAIRS = 16  # of a cone and a body, processed at once
_TRIPLES = 32  # of a cone, a body and a block, processed at once
_SAME = 1e-6  # m, rounding difference of two loops' values at one point
_MARGIN = 0.021  # m from a cone within which a body may matter


@partial(
    jax.tree_util.register_dataclass, data_fields=("cones", "bodies"), meta_fields=("occlusion",)
)
@dataclass(frozen=True)
class Hidden:
    """Beams and the bodies that occlude them at the same pose."""

    cones: Cones
    """Cones or mixed beams."""
    bodies: Capsules
    """The robot's bodies, one axis of N capsules."""
    occlusion: Occlusion
    """The occlusion model, a compile-time constant."""


class HiddenBeams(SoftBeams):
    """Beams with occlusion by bodies; see ``SoftBeams``.

    ``free`` are the beams without bodies; the parts and columns that describe occlusion follow
    theirs. Some beams may be blinded and others shadowed, depending on their zones. ``obstacles``
    also blind, but cast no shadows here.
    """

    def __init__(self, hidden: Hidden, obstacles: tuple[Polyhedron, ...] = ()) -> None:
        self.free, self.bodies = soft_beams(hidden.cones), hidden.bodies
        self.cones, self.count = self.free.cones, self.free.count
        cones, around = self.cones, self.cones.around()
        self.parts, self.columns = self.free.parts, self.free.columns
        zoned: Any = cones.zoned if isinstance(cones, MixedBeams) else None
        self.stops = hidden.occlusion == "blind"
        self.shadows = not self.stops or zoned is not None
        if self.stops:
            self.columns += 1

            def stop_of(apex: Array, axis: Array) -> Any:
                stop = soft_stop(replace(around, apex=apex, axis=axis), self.bodies, obstacles)
                return stop if zoned is None else jnp.where(zoned, jnp.inf, stop)

            stop, self._pull_stop = jax.vjp(stop_of, cones.apex, cones.axis)
            self.parts = (*self.parts, jnp.append(stop, jnp.zeros(1, stop.dtype)))
        if not self.shadows:
            return
        start, end, radius = (a[None] for a in self.bodies.arrays())
        looks = Beam(*(a[:, None] for a in vars(around).values()))
        matters = capsule_gap(looks, start, end, radius, steps=_STEPS)[0] < _MARGIN
        depth, _ = self._depth(cones.apex[:, None], start, end, radius)
        deepest = jnp.arange(depth.shape[1])[None] == depth.argmax(axis=1)[:, None]
        # a single body that contains the apex suffices
        matters = jnp.where((depth > 0).any(axis=1, keepdims=True), deepest, matters)
        if self.stops:
            matters = matters & zoned[:, None]
        self._matters = matters
        pairs = jnp.argsort(~matters.ravel(), stable=True).astype(jnp.int32)
        self._pairs = jnp.pad(pairs, (0, -len(pairs) % _PAIRS))

    def near(self, blocks: tuple[Array, ...], width: Numbers, cut: Numbers) -> Near:
        """See ``SoftBeams``.

        A beam that a body occludes from a whole block is omitted for it. Of the other beams, only
        the blocks that a shadow reaches are evaluated point by point. The shadows' values and
        slopes there are precomputed.
        """
        if not self.shadows:
            return super().near(blocks, width, cut)
        points, weight, centre, radius = blocks
        near, (g, size) = self._reach(blocks, width, cut), weight.shape
        bodies, count = self._matters.shape[1], self._matters.sum()

        def look(i: Index, state: tuple[jax.Array, ...]) -> tuple[Any, Any, Any]:
            hidden, todo, number = state
            some = jax.lax.dynamic_slice_in_dim(self._pairs, i * _PAIRS, _PAIRS)
            beam, body = some // bodies, some % bodies
            value = self._value(self.cones.apex[beam][:, None], centre[None], body[:, None])[0][
                :, 0
            ]
            there = (i * _PAIRS + jnp.arange(_PAIRS) < count)[:, None] & near[:, beam].T
            hidden = hidden.at[:, beam].max((there & (value > (radius + cut * width)[None])).T)
            reached = (there & (value > -(radius + _NEAR * width)[None])).ravel()
            place = jnp.where(reached, number + jnp.cumsum(reached, dtype=jnp.int32) - 1, len(todo))
            entries = (some[:, None] * g + jnp.arange(g, dtype=some.dtype)[None]).ravel()
            return (
                hidden,
                todo.at[place].set(entries, mode="drop"),
                number + reached.sum(dtype=jnp.int32),
            )

        todo = jnp.zeros(self._matters.size * g + _TRIPLES, jnp.int32)
        start = jnp.zeros_like(near), todo, jnp.zeros((), jnp.int32)
        hidden, todo, number = jax.lax.fori_loop(0, -(-count // _PAIRS), look, start)

        def evaluate(i: Index) -> tuple[Any, Any, Any]:
            """Return the i-th batch: rows of beams at blocks, the bodies' values, and slopes."""
            some = jax.lax.dynamic_slice_in_dim(todo, i * _TRIPLES, _TRIPLES)
            pair, block = some // g, some % g
            beam = pair // bodies
            value, slopes = self._value(
                self.cones.apex[beam][:, None], points[block], (pair % bodies)[:, None]
            )
            row = jnp.where(
                i * _TRIPLES + jnp.arange(_TRIPLES) < number, block * (self.count + 1) + beam, rows
            )
            return row, value[:, 0], [slope[:, 0] for slope in slopes]

        def accumulate(i: Index, state: tuple[jax.Array, ...]) -> Any:
            row, value, slopes = evaluate(i)
            most, *sums = state
            after = most.at[row].max(value, mode="drop")
            before, least = (a.at[row].get(mode="fill", fill_value=jnp.inf) for a in (most, after))
            kept, best = ((a >= least - _SAME).astype(value.dtype) for a in (before, value))
            more = (best, *(best * slope for slope in slopes))
            return after, *(
                a.at[row].multiply(kept, mode="drop").at[row].add(b, mode="drop")
                for a, b in zip(sums, more, strict=True)
            )

        rows, chunks = g * (self.count + 1), -(-number // _TRIPLES)
        nothing = (
            jnp.full((rows, size), -jnp.inf, points.dtype),
            *(jnp.zeros((rows, size), points.dtype),) * 4,
        )
        most, equal, *slopes = jax.lax.fori_loop(0, chunks, accumulate, nothing)
        # where bodies meet, two may have the same value
        slopes = [slope / jnp.maximum(equal, 1) for slope in slopes]
        index, pieces = self._in_pieces(near & ~hidden)

        def beams_of(j: Index) -> tuple[Any, tuple[Any, ...]]:
            chosen = index(j)
            row = jnp.arange(g, dtype=chosen.dtype)[:, None] * (self.count + 1) + chosen
            return chosen, (*(a[chosen] for a in self.parts), *(a[row] for a in (most, *slopes)))

        return Near(*pieces, beams_of)

    def _reach(self, blocks: tuple[Array, ...], width: Numbers, cut: Numbers) -> Any:
        return self.free._reach(blocks, width, cut)

    def _value(self, apex: Array, points: Array, body: Index) -> tuple[Any, Any]:
        """Return the value of a body of each cone (g, c) at points (g, B), and its slopes.

        The value (g, c, B) m is positive where the body occludes the point. The three slopes are by
        the apex.

        A ball of a shadow lies about a + t (k - a), with k on the body's axis and t >= 1, and its
        radius is r t. When the apex a moves, k and t of the determining ball may be held constant,
        as they are optimal. With u the unit vector from its centre to the point, -behind therefore
        grows by (1 - t) u.
        """
        start, end, radius = (
            self.bodies.start[body],
            self.bodies.end[body],
            self.bodies.radius[body],
        )
        shadow = jax.tree.map(
            partial(_for_points, ndim=apex.ndim), capsule_shadow(apex, start, end, radius)
        )
        ball = nearest_ball(points[:, None], shadow)
        length = root(ball.along * ball.along + ball.away * ball.away + ball.across * ball.across)
        share = (1 - ball.radius / shadow.radius) / jnp.where(length > 0, length, 1.0)
        ways = (ball.along, shadow.along), (ball.away, shadow.away), (ball.across, shadow.across)
        slopes = tuple(share * sum(way * axis[..., i] for way, axis in ways) for i in range(3))
        depth, out = self._depth(apex, start, end, radius)
        within = (depth > 0)[..., None]
        value = jnp.where(
            within, jnp.maximum(_OUT * depth[..., None], ball.radius - length), ball.radius - length
        )
        return value, tuple(
            jnp.where(within, -_OUT * out[..., None, i], s) for i, s in enumerate(slopes)
        )

    @staticmethod
    def _depth(apex: Array, start: Array, end: Array, radius: Numbers) -> tuple[Any, Any]:
        """Return the depth of apexes (..., 3) in bodies, m, and the outward direction (..., 3)."""
        v = from_segment(apex, start, end)
        length = root(dot(v, v))
        return radius - length, v / jnp.where(length > 0, length, 1.0)[..., None]

    def pairs(self, points: Array, some: Any, width: Numbers) -> tuple[Any, ...]:
        """Evaluate as ``SoftBeams`` does; also return where a body occludes, and its slopes.

        The slopes are by the apex.
        """
        t, *geometry = self.free.pairs(points, some, width)
        most, *slopes = some[-4:] if self.shadows else self._past(points, some)
        if self.shadows and self.stops:
            past, *others = self._past(points, some)
            slopes = [
                jnp.where(past > most, new, old) for new, old in zip(others, slopes, strict=True)
            ]
            most = jnp.maximum(past, most)
        most = most * (1 / width)
        return jnp.maximum(t, most), *geometry, most > t, *slopes

    def _past(self, points: Array, some: Any) -> tuple[Any, ...]:
        """Return how far points lie beyond the first return (g, c, B) m, and its slopes."""
        v = points[:, None] - some[0][:, :, None]
        length = root(dot(v, v))
        by = (-v[..., i] / jnp.where(length > 0, length, 1.0) for i in range(3))
        return length - some[len(self.free.parts)][..., None], *by

    def slopes(self, points: Array, some: Any, pull: Array, *geometry: Array) -> Any:
        """See ``SoftBeams``; for blinded beams the last column is the slope by the first return."""
        *of_beam, hidden, x, y, z = geometry
        gradient = self.free.slopes(points, some, jnp.where(hidden, 0, pull), *of_beam)
        pull = jnp.where(hidden, pull, 0)
        gradient = gradient + by_apex(pull, (x, y, z), gradient.shape[2])
        return (
            jnp.concatenate([gradient, -pull.sum(axis=2)[..., None]], axis=2)
            if self.stops
            else gradient
        )

    def pulled_back(self, slope: Array) -> tuple[Any, ...]:
        """See ``SoftBeams``; the first return of a beam that is not blinded has no slope."""
        apex, axis, *rest = self.free.pulled_back(slope)
        if not self.stops:
            return apex, axis, *rest
        more_apex, more_axis = self._pull_stop(slope[:, -1])
        return apex + more_apex, axis + more_axis, *rest


@soft_beams.register
def _(seen: Hidden) -> SoftBeams:
    return HiddenBeams(seen)


def _for_points(a: Array, ndim: int) -> Any:
    """Insert an axis for points into values of shape (g, c) or (g, c, 3 or 2)."""
    return a[..., None] if a.ndim == ndim - 1 else a[..., None, :]
