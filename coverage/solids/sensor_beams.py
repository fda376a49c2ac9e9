"""Beams of sensors without occlusion: cones, pyramids, domes and fans, mixed in one setup."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from ..arrays import Array, Index, Numbers, cross, dot, namespace, rows
from ..pytrees import mapped, tree
from .base import CubePairs
from .cones import Cones, cone
from .domes import Domes, dome
from .fans import Fans, fan
from .pyramids import Pyramids, pyramid
from .tangent_bounds import Tangent
from .volume_fraction import VolumeFraction


def _rows_where(which: Bool[np.ndarray, " K"], values: Array) -> np.ndarray:
    some: np.ndarray = np.asarray(values)[which]
    return some


class SpecialShapes(NamedTuple):
    """What makes beams of K sensors more than plain cones and pyramids."""

    dome: Bool[Array, "*batch K"]
    """Which beams end in a ball about the apex."""
    half_thickness: Float[Array, "*batch K"]
    """Half thicknesses of fans, m; 0: no fan."""
    near: Float[Array, "*batch K"]
    """Distances along the axis at which cones and pyramids begin, m."""


class BeamShapes(NamedTuple):
    """Shapes of the beams of K sensors, without their poses."""

    half_angle: Float[Array, "*batch K"]
    """Half angles, rad, in (0, pi/2); of a square beam the one along its ring."""
    range_m: Float[Array, "*batch K"]
    """Ranges, m; minus infinity: a sensor that sees nothing."""
    half_up: Float[Array, "*batch K"] | None = None
    """Half angles of square beams along ``up``, rad; 0 for cones. None: all beams are cones."""
    zoned: Bool[Array, "*batch K"] | None = None
    """Which beams have several zones; None if ``half_up`` is None."""
    special: SpecialShapes | None = None
    """Domes, fans and least ranges; None where there are none, or if ``half_up`` is None."""

    @property
    def square(self) -> bool:
        """Whether some beams may be square, so that they need an up vector."""
        return self.half_up is not None

    def solids(self, apex: Array, axis: Array, up: Array | None = None) -> Cones:
        """Return V_FOV of sensors with given poses: plain cones if none may be square.

        Plain cones are faster to count.

        Args:
            apex: (K, 3) m.
            axis: (K, 3), unit vectors.
            up: (K, 3), unit vectors of square beams.

        Raises:
            ValueError: if beams may be square and ``up`` is missing.
        """
        if self.half_up is None:
            return Cones(apex, axis, self.half_angle, self.range_m)
        if up is None or self.zoned is None:
            raise ValueError("square beams need their up vectors and their zones")
        look = (apex, axis, self.half_angle, self.range_m)
        return MixedBeams(*look, up, self.half_up, self.zoned, self.special)


_WIDE = 1.4  # rad, half angle above which a dome has no circumscribed cone
_ARC = 33  # points of an arc in a drawing


@tree
@dataclass(frozen=True)
class MixedBeams(Cones):
    """A union of cones, pyramids, domes and fans, numbered together.

    A part with ``half_up`` above 0 is a pyramid. Each part has the implicit function of its shape,
    and the half-space beyond the distance at which it begins keeps the Lipschitz constant 1, so the
    union is 1-Lipschitz.
    """

    up: Float[Array, "K 3"]
    """Unit vectors perpendicular to the axes of pyramids, domes and fans; meaningless for cones."""
    half_up: Float[Array, " K"]
    """Half angles along ``up``, rad; 0 for cones."""
    zoned: Bool[Array, " K"]
    """Which parts have several zones, so that an occluder in some zones does not affect the
    others."""
    special: SpecialShapes | None = None
    """Domes, fans and least ranges; None: there are none."""

    def part(self, points: Array, index: Index) -> Any:
        special = self.special and SpecialShapes(*(a[index] for a in self.special))
        half, range_m, half_up = self.half_angle[index], self.range_m[index], self.half_up[index]
        apex, axis, up = (rows(a, index) for a in (self.apex, self.axis, self.up))
        shapes = BeamShapes(half, range_m, half_up, self.zoned[index], special)
        return beam_function(shapes, points, apex, axis, up)

    def _by_shape(self, index: Index) -> tuple[tuple[Any, Any], ...]:
        """Return, for each shape, which pairs have it and the union of that shape."""
        square, look = self.is_square()[index], (self.apex, self.axis, self.half_angle)
        if self.special is None:
            return (~square, Cones(*look, self.range_m)), (square, self.pyramids())
        domed = np.asarray(self.special.dome)[index]
        fanned = np.asarray(self.special.half_thickness)[index] > 0
        return (
            (~square & ~domed & ~fanned, Cones(*look, self.range_m)),
            (square, self.pyramids()),
            (domed, Domes(*look, self.range_m)),
            (fanned, Fans(*look, self.range_m, self.up, self.special.half_thickness)),
        )

    def pyramids(self) -> Pyramids:
        """Return all parts as pyramids; only those of actual pyramids are meaningful."""
        return Pyramids(self.apex, self.axis, self.half_angle, self.range_m, self.up, self.half_up)

    def split(self, index: Index, work: Callable[[Any, Any], Any]) -> list[Any]:
        """Return ``work(indices of pairs, union)`` for each shape among parts ``index`` (P,)."""
        return [
            work(np.flatnonzero(which), parts)
            for which, parts in self._by_shape(index)
            if which.any()
        ]

    def beginning(
        self, points: Float[np.ndarray, "P 3"], index: Int[np.ndarray, " P"]
    ) -> tuple[Int[np.ndarray, " B"], Float[np.ndarray, " B"], Float[np.ndarray, "B 3"]]:
        """Return which of P pairs have beams that begin at a distance from the apex, how far beyond
        that plane their points lie, m, and the axes."""
        none = np.zeros(0, int)
        at = (
            none
            if self.special is None
            else np.flatnonzero(np.asarray(self.special.near)[index] > 0)
        )
        if self.special is None or len(at) == 0:
            return none, np.zeros(0), np.zeros((0, 3))
        axis, apex = (rows(a, index[at]) for a in (self.axis, self.apex))
        return at, dot(points[at] - apex, axis) - self.special.near[index[at]], axis

    def each_share(self, pairs: CubePairs) -> tuple[VolumeFraction, Any, Any]:
        """See ``Cones.each_share``; each pair is evaluated by its shape, and the plane at which a
        beam begins has no curvature."""
        n = len(pairs.part)
        share, normal = VolumeFraction(np.zeros(n), np.zeros(n)), np.zeros((n, 3))
        value = np.zeros(n)

        def fill(k: Any, shape: Any) -> None:
            bounds, value[k], normal[k] = shape.each_share(pairs.only(k))
            share.low[k], share.high[k] = bounds.low, bounds.high

        self.split(pairs.part, fill)
        at, beyond, axis = self.beginning(pairs.points, pairs.part)
        if len(at):
            begin = Tangent(-beyond, -axis, np.zeros(len(at)))
            share.cut(at, begin.share(pairs.side, pairs.slack))
        return share, value, normal

    def around(self) -> Cones:
        """Return the circumscribed cones of all parts that are not wide, through a pyramid's
        corners."""
        xp = namespace(self.half_up)
        corner = xp.arctan(xp.hypot(xp.tan(self.half_angle), xp.tan(self.half_up)))
        half = xp.where(self.half_up > 0, corner, self.half_angle)
        half = half if self.special is None else xp.minimum(half, _WIDE)
        return Cones(self.apex, self.axis, half, self.range_m)

    def is_square(self) -> Bool[np.ndarray, " K"]:
        """Return which parts are pyramids."""
        return np.asarray(self.half_up) > 0

    def is_wide(self) -> Bool[Array, " K"]:
        """See ``Cones.is_wide``; a fan holds points beside its apex."""
        if self.special is None:
            return super().is_wide()
        domed, thickness, _ = self.special
        wide: Array = (thickness > 0) | (domed & (self.half_angle > _WIDE))
        return wide

    def is_zoned(self) -> Bool[np.ndarray, " K"]:
        """Return which parts have several zones."""
        return np.asarray(self.zoned)

    def corners_across(self, k: int, length: float) -> Float[np.ndarray, "M 3"]:
        """See ``Cones.corners_across``; a pyramid has four. A dome's and a fan's are points of
        their rims, at ``length`` from the apex."""
        half, up, axis = float(self.half_angle[k]), np.asarray(self.up[k]), np.asarray(self.axis[k])
        side = cross(up, axis)
        if self.special is not None and (thick := float(self.special.half_thickness[k])) > 0:
            turn = np.linspace(-half, half, _ARC)[:, None]
            arc = length * (np.cos(turn) * axis + np.sin(turn) * side - axis)
            return np.concatenate([arc + thick * up, (arc - thick * up)[::-1]])
        if self.special is not None and self.special.dome[k]:
            turn = np.linspace(0, 2 * np.pi, _ARC)[:-1, None]
            ring = np.cos(turn) * side + np.sin(turn) * up
            circle: np.ndarray = length * (np.cos(half) * axis + np.sin(half) * ring - axis)
            return circle
        if not self.half_up[k] > 0:
            return super().corners_across(k, length)
        x, y = length * np.tan(half) * side, length * np.tan(self.half_up[k]) * up
        return np.array([x + y, y - x, -x - y, x - y])

    def within(self, k: int, unit: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        """See ``Cones.within``."""
        for which, shape in self._by_shape(np.arange(len(self)))[2:]:
            if which[k]:
                point: np.ndarray = shape.within(k, unit)
                return point
        if self.special is not None:
            begin = (self.special.near[k] / self.range_m[k]) ** 3
            unit = np.column_stack([begin + (1 - begin) * unit[:, 0], unit[:, 1:]])
        if not self.half_up[k] > 0:
            return super().within(k, unit)
        axis, up, d = self.axis[k], self.up[k], self.range_m[k] * unit[:, 0] ** (1 / 3)
        wide, high = (
            np.tan(half[k]) * (2 * unit[:, i] - 1)
            for i, half in ((1, self.half_angle), (2, self.half_up))
        )
        along = axis + wide[:, None] * cross(up, axis) + high[:, None] * up
        point = self.apex[k] + d[:, None] * along
        return point

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        boxes = [
            mapped(partial(_rows_where, which), parts).bounds()
            for which, parts in self._by_shape(np.arange(len(self)))
            if which.any()
        ]
        if not boxes:
            return np.zeros((2, 3))
        return np.stack([np.min(boxes, axis=0)[0], np.max(boxes, axis=0)[1]])


def beam(
    points: Array,
    apex: Array,
    axis: Array,
    half: Numbers,
    range_m: Numbers,
    up: Array,
    half_up: Array,
) -> Any:
    """Return the implicit function of a cone, or of a pyramid where ``half_up`` is above 0.

    For the arguments see ``pyramid``.
    """
    xp = namespace(half_up)
    round_ = cone(points, apex, axis, xp.cos(half), xp.sin(half), range_m)
    return xp.where(half_up > 0, pyramid(points, apex, axis, up, half, half_up, range_m), round_)


def beam_function(shapes: BeamShapes, points: Array, apex: Array, axis: Array, up: Array) -> Any:
    """Return the implicit function of beams of any shape, m; all arguments broadcast.

    Args:
        shapes: shapes (...) of the beams.
        points, apex: (..., 3) m.
        axis, up: (..., 3), unit vectors; for ``up`` see ``pyramid``.
    """
    half, range_m = shapes.half_angle, shapes.range_m
    xp = namespace(half)
    if shapes.half_up is None:
        return cone(points, apex, axis, xp.cos(half), xp.sin(half), range_m)
    value = beam(points, apex, axis, half, range_m, up, shapes.half_up)
    if shapes.special is None:
        return value
    domed, thick, near = shapes.special
    cap = dome(points, apex, axis, xp.cos(half), xp.sin(half), range_m)
    sector = fan(points, apex, axis, up, half, thick, range_m)
    value = xp.where(domed, cap, xp.where(thick > 0, sector, value))
    return xp.maximum(value, xp.where(near > 0, near - dot(points - apex, axis), -xp.inf))
