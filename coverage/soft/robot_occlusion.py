"""Occlusion of beams by the robot's bodies, for the soft estimator.

A beam with shadows has the maximum of the cone's function and of minus that of each shadow in it.
Only the bodies near a cone are evaluated, and only at the blocks of points that their shadows
reach. At each point, only the shadow that attains the maximum has a slope.

The beam of a blinded sensor ends at its first return (``first_return``). A multi-zone sensor is not
blinded as a whole: its beam has shadows.

A sensor inside a body sees nothing, and the slope there only points out of the body.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from ..arrays import Array, Index, Numbers, dot, root
from ..occlusion.first_return import Beam, capsule_gap
from ..solids.capsule_shadows import capsule_shadow, nearest_ball
from ..solids.capsules import Capsules
from ..solids.cones import Cones
from ..solids.segments import from_segment
from ..solids.sensor_beams import MixedBeams
from .cones import Near, SoftBeams, by_apex

# metres by which a beam is moved away from all points, per metre that its apex lies within a body
_OUT = 10.0
_STEPS = 18  # to find the place on a body's axis that is nearest to a cone
_NEAR = 3.0  # widths from a shadow within which it matters to a block
_PAIRS = 16  # of a cone and a body, processed at once
_TRIPLES = 32  # of a cone, a body and a block, processed at once
_SAME = 1e-6  # m, rounding difference of two loops' values at one point
_MARGIN = 0.021  # m from a cone within which a body may matter

# smooth first returns (K,) m of the sensors of cones
FirstReturn = Callable[[Cones], Any]


class _Reached(NamedTuple):
    """Where shadows matter to a group of g blocks."""

    hidden: Any
    """Whether a shadow contains all of a block, for each beam: (g, K)."""
    triples: Any
    """Numbers of the triples of a beam, a body and a block that its shadow reaches, in front."""
    count: Any
    """Number of these triples."""


class _Shadows:
    """The shadows of bodies in K beams: their values at points, and the slopes by the apexes."""

    def __init__(self, cones: Cones, bodies: Capsules, shadowed: Array | None = None) -> None:
        """Find the bodies that matter; ``shadowed`` (K,) selects beams, None: all of them."""
        self.apex, self.count, self.bodies = cones.apex, len(cones), bodies
        start, end, radius = (a[None] for a in bodies.arrays())
        looks = Beam(*(a[:, None] for a in vars(cones.around()).values()))
        matters = capsule_gap(looks, start, end, radius, steps=_STEPS)[0] < _MARGIN
        matters = matters | cones.is_wide()[:, None]
        depth, _ = self._depth(cones.apex[:, None], start, end, radius)
        deepest = jnp.arange(depth.shape[1])[None] == depth.argmax(axis=1)[:, None]
        # a single body that contains the apex suffices
        matters = jnp.where((depth > 0).any(axis=1, keepdims=True), deepest, matters)
        if shadowed is not None:
            matters = matters & shadowed[:, None]
        self._matters = matters  # (K, N)
        pairs = jnp.argsort(~matters.ravel(), stable=True).astype(jnp.int32)
        self._pairs = jnp.pad(pairs, (0, -len(pairs) % _PAIRS))

    def reached(
        self, blocks: tuple[Array, ...], near: Array, width: Numbers, cut: Numbers
    ) -> _Reached:
        """Return which shadows reach or contain the blocks that come ``near`` (g, K) the beams."""
        _, weight, centre, radius = blocks
        g, bodies, count = len(weight), self._matters.shape[1], self._matters.sum()

        def look(i: Index, state: tuple[jax.Array, ...]) -> tuple[Any, Any, Any]:
            hidden, todo, number = state
            some = jax.lax.dynamic_slice_in_dim(self._pairs, i * _PAIRS, _PAIRS)
            beam, body = some // bodies, some % bodies
            value = self._value(self.apex[beam][:, None], centre[None], body[:, None])[0][:, 0]
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
        return _Reached(*jax.lax.fori_loop(0, -(-count // _PAIRS), look, start))

    def deepest(self, points: Array, reached: _Reached) -> tuple[Any, ...]:
        """Return the largest value of a shadow at each point, and its slopes by the apex.

        Args:
            points: points (g, B, 3) m of the blocks.
            reached: shadows that reach the blocks; the others are not evaluated.

        Returns:
            Four arrays (g (K + 1), B): for each block its beams, and one of padding. The values are
                m, minus infinity where no shadow reaches.
        """
        (g, size, _), bodies = points.shape, self._matters.shape[1]
        rows, (_, todo, number) = g * (self.count + 1), reached

        def evaluate(i: Index) -> tuple[Any, Any, Any]:
            """Return the i-th batch: rows of beams at blocks, the bodies' values, and slopes."""
            some = jax.lax.dynamic_slice_in_dim(todo, i * _TRIPLES, _TRIPLES)
            pair, block = some // g, some % g
            beam = pair // bodies
            value, slopes = self._value(
                self.apex[beam][:, None], points[block], (pair % bodies)[:, None]
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

        nothing = (
            jnp.full((rows, size), -jnp.inf, points.dtype),
            *(jnp.zeros((rows, size), points.dtype),) * 4,
        )
        most, equal, *slopes = jax.lax.fori_loop(0, -(-number // _TRIPLES), accumulate, nothing)
        # where bodies meet, two may have the same value
        return most, *(slope / jnp.maximum(equal, 1) for slope in slopes)

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


class HiddenBeams(SoftBeams):
    """Beams with occlusion by bodies; see ``SoftBeams``.

    ``free`` are the beams without bodies; the parts and columns that describe occlusion follow
    theirs. Without ``first_return``, the bodies cast shadows. With it, single-zone sensors are
    blinded, and only multi-zone sensors have shadows.
    """

    def __init__(
        self, free: SoftBeams, bodies: Capsules, first_return: FirstReturn | None = None
    ) -> None:
        self.free, self.cones, self.count = free, free.cones, free.count
        self.parts, self.columns = free.parts, free.columns
        cones = self.cones
        zoned: Any = cones.zoned if isinstance(cones, MixedBeams) else None
        self.stops = first_return is not None
        if first_return is not None:
            self.columns += 1

            def stop_of(apex: Array, axis: Array) -> Any:
                stop = first_return(replace(cones.around(), apex=apex, axis=axis))
                return stop if zoned is None else jnp.where(zoned, jnp.inf, stop)

            stop, self._pull_stop = jax.vjp(stop_of, cones.apex, cones.axis)
            self.parts = (*self.parts, jnp.append(stop, jnp.zeros(1, stop.dtype)))
        self.shadows: _Shadows | None = None
        if not self.stops or zoned is not None:
            self.shadows = _Shadows(cones, bodies, zoned if self.stops else None)

    def near(self, blocks: tuple[Array, ...], width: Numbers, cut: Numbers) -> Near:
        """See ``SoftBeams``.

        A beam that a body occludes from a whole block is omitted for it. Of the other beams, only
        the blocks that a shadow reaches are evaluated point by point. The shadows' values and
        slopes there are precomputed.
        """
        if self.shadows is None:
            return super().near(blocks, width, cut)
        near, g = self._reach(blocks, width, cut), len(blocks[1])
        reached = self.shadows.reached(blocks, near, width, cut)
        deepest = self.shadows.deepest(blocks[0], reached)
        index, pieces = self._in_pieces(near & ~reached.hidden)

        def beams_of(j: Index) -> tuple[Any, tuple[Any, ...]]:
            chosen = index(j)
            row = jnp.arange(g, dtype=chosen.dtype)[:, None] * (self.count + 1) + chosen
            return chosen, (*(a[chosen] for a in self.parts), *(a[row] for a in deepest))

        return Near(*pieces, beams_of)

    def _reach(self, blocks: tuple[Array, ...], width: Numbers, cut: Numbers) -> Any:
        return self.free._reach(blocks, width, cut)

    def pairs(self, points: Array, some: Any, width: Numbers) -> tuple[Any, ...]:
        """Evaluate as ``SoftBeams`` does; also return where a body occludes, and its slopes.

        The slopes are by the apex.
        """
        t, *geometry = self.free.pairs(points, some, width)
        most, *slopes = some[-4:] if self.shadows is not None else self._past(points, some)
        if self.shadows is not None and self.stops:
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


def _for_points(a: Array, ndim: int) -> Any:
    """Insert an axis for points into values of shape (g, c) or (g, c, 3 or 2)."""
    return a[..., None] if a.ndim == ndim - 1 else a[..., None, :]
