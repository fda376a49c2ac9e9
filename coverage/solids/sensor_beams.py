"""Beams of sensors without occlusion: cones, pyramids, domes and fans, mixed in one setup."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from ..arrays import Array, Index, Numbers, cross, dot, namespace, rows
from ..pytrees import mapped, tree
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
        beams = (apex, axis, self.half_angle, self.range_m, up, self.half_up, self.zoned)
        return MixedBeams(*beams) if self.special is None else SpecialBeams(*beams, *self.special)


@tree
@dataclass(frozen=True)
class MixedBeams(Cones):
    """A union of cones and pyramids, numbered together.

    A part with ``half_up`` above 0 is a pyramid. Each part has the implicit function of its shape,
    so the union is 1-Lipschitz.
    """

    up: Float[Array, "K 3"]
    """Unit vectors perpendicular to the axes of pyramids; meaningless for cones."""
    half_up: Float[Array, " K"]
    """Half angles along ``up``, rad; 0 for cones."""
    zoned: Bool[Array, " K"]
    """Which parts have several zones, so that an occluder in some zones does not affect the
    others."""

    def part(self, points: Array, index: Index) -> Any:
        half, half_up, range_m = self.half_angle[index], self.half_up[index], self.range_m[index]
        apex, axis, up = (rows(a, index) for a in (self.apex, self.axis, self.up))
        return beam(points, apex, axis, half, range_m, up, half_up)

    def _by_shape(self, index: Index) -> tuple[tuple[Any, Any], ...]:
        """Return, for each shape, which pairs have it and the union of that shape."""
        square = self.is_square()[index]
        round_ = Cones(self.apex, self.axis, self.half_angle, self.range_m)
        return (~square, round_), (square, self.pyramids())

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

    def each_share(
        self,
        points: Float[np.ndarray, "P 3"],
        index: Int[np.ndarray, " P"],
        side: float,
        slack: float,
    ) -> tuple[VolumeFraction, Any, Any]:
        """See ``Cones.each_share``; each pair is evaluated by its shape."""
        n = len(index)
        share, value, normal = (
            VolumeFraction(np.zeros(n), np.zeros(n)),
            np.zeros(n),
            np.zeros((n, 3)),
        )

        def fill(k: Index, shape: Any) -> None:
            bounds, value[k], normal[k] = shape.each_share(rows(points, k), index[k], side, slack)
            share.low[k], share.high[k] = bounds.low, bounds.high

        self.split(index, fill)
        return share, value, normal

    def around(self) -> Cones:
        """Return the circumscribed cones of the beams, through a pyramid's corners."""
        xp = namespace(self.half_up)
        corner = xp.arctan(xp.hypot(xp.tan(self.half_angle), xp.tan(self.half_up)))
        return Cones(
            self.apex, self.axis, xp.where(self.half_up > 0, corner, self.half_angle), self.range_m
        )

    def is_square(self) -> Bool[np.ndarray, " K"]:
        """Return which parts are pyramids."""
        return np.asarray(self.half_up) > 0

    def is_zoned(self) -> Bool[np.ndarray, " K"]:
        """Return which parts have several zones."""
        return np.asarray(self.zoned)

    def corners_across(self, k: int, length: float) -> Float[np.ndarray, "M 3"]:
        """See ``Cones.corners_across``; a pyramid has four."""
        if not self.half_up[k] > 0:
            return super().corners_across(k, length)
        up, axis = self.up[k], self.axis[k]
        x = length * np.tan(self.half_angle[k]) * cross(up, axis)
        y = length * np.tan(self.half_up[k]) * up
        return np.array([x + y, y - x, -x - y, x - y])

    def within(self, k: int, unit: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        """See ``Cones.within``."""
        if not self.half_up[k] > 0:
            return super().within(k, unit)
        axis, up, d = self.axis[k], self.up[k], self.range_m[k] * unit[:, 0] ** (1 / 3)
        wide, high = (
            np.tan(half[k]) * (2 * unit[:, i] - 1)
            for i, half in ((1, self.half_angle), (2, self.half_up))
        )
        along = axis + wide[:, None] * cross(up, axis) + high[:, None] * up
        point: np.ndarray = self.apex[k] + d[:, None] * along
        return point

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        square = self.is_square()
        boxes = []
        for which, parts in self._by_shape(np.arange(len(self))):
            if which.any():
                boxes.append(mapped(partial(_rows_where, which), parts).bounds())
        return (
            np.stack([np.min(boxes, axis=0)[0], np.max(boxes, axis=0)[1]])
            if len(square)
            else np.zeros((2, 3))
        )


_WIDE = 1.4  # rad, half angle above which a dome has no circumscribed cone
_ARC = 33  # points of an arc in a drawing


@tree
@dataclass(frozen=True)
class SpecialBeams(MixedBeams):
    """A union of cones, pyramids, domes and fans, numbered together.

    Cones and pyramids begin at a distance ``near`` along the axis: the intersection with the
    half-space ``near - d``, which keeps the Lipschitz constant 1.
    """

    dome: Bool[Array, " K"]
    """Which parts are domes."""
    half_thickness: Float[Array, " K"]
    """Half thicknesses of fans, m; 0 for other parts."""
    near: Float[Array, " K"]
    """Distances along the axis at which cones and pyramids begin, m; 0 for other parts."""

    def part(self, points: Array, index: Index) -> Any:
        special = SpecialShapes(self.dome[index], self.half_thickness[index], self.near[index])
        half, range_m, half_up = self.half_angle[index], self.range_m[index], self.half_up[index]
        apex, axis, up = (rows(a, index) for a in (self.apex, self.axis, self.up))
        shapes = BeamShapes(half, range_m, half_up, self.zoned[index], special)
        return beam_function(shapes, points, apex, axis, up)

    def _by_shape(self, index: Index) -> tuple[tuple[Any, Any], ...]:
        square, domed = self.is_square()[index], np.asarray(self.dome)[index]
        fanned = np.asarray(self.half_thickness)[index] > 0
        (_, round_), (_, pyramids) = super()._by_shape(index)
        look = (self.apex, self.axis, self.half_angle, self.range_m)
        return (
            (~square & ~domed & ~fanned, round_),
            (square, pyramids),
            (domed, Domes(*look)),
            (fanned, Fans(*look, self.up, self.half_thickness)),
        )

    def each_share(
        self,
        points: Float[np.ndarray, "P 3"],
        index: Int[np.ndarray, " P"],
        side: float,
        slack: float,
    ) -> tuple[VolumeFraction, Any, Any]:
        """See ``Cones.each_share``; the plane at which a beam begins has no curvature."""
        share, value, normal = super().each_share(points, index, side, slack)
        cut = np.flatnonzero(np.asarray(self.near)[index] > 0)
        if len(cut):
            axis = rows(self.axis, index[cut])
            d = dot(points[cut] - rows(self.apex, index[cut]), axis)
            begin = Tangent(self.near[index[cut]] - d, -axis, np.zeros(len(cut)))
            both = share.only(cut) & begin.share(side, slack)
            share.low[cut], share.high[cut] = both.low, both.high
        return share, value, normal

    def is_wide(self) -> Bool[Array, " K"]:
        """See ``Cones.is_wide``; a fan holds points beside its apex."""
        wide: Array = (self.half_thickness > 0) | (self.dome & (self.half_angle > _WIDE))
        return wide

    def around(self) -> Cones:
        """Return circumscribed cones of all parts that are not wide."""
        plain = super().around()
        xp = namespace(self.half_angle)
        return Cones(plain.apex, plain.axis, xp.minimum(plain.half_angle, _WIDE), plain.range_m)

    def corners_across(self, k: int, length: float) -> Float[np.ndarray, "M 3"]:
        """See ``Cones.corners_across``; a dome's and a fan's are points of their rims, at
        ``length`` from the apex."""
        half, thick = float(self.half_angle[k]), float(self.half_thickness[k])
        if not self.dome[k] and not thick > 0:
            return super().corners_across(k, length)
        axis, up = np.asarray(self.axis[k]), np.asarray(self.up[k])
        side = cross(up, axis)
        if thick > 0:
            turn = np.linspace(-half, half, _ARC)[:, None]
            arc = length * (np.cos(turn) * axis + np.sin(turn) * side - axis)
            rim: np.ndarray = np.concatenate([arc + thick * up, (arc - thick * up)[::-1]])
            return rim
        turn = np.linspace(0, 2 * np.pi, _ARC)[:-1, None]
        circle = np.cos(half) * axis + np.sin(half) * (np.cos(turn) * side + np.sin(turn) * up)
        ring: np.ndarray = length * (circle - axis)
        return ring

    def within(self, k: int, unit: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        """See ``Cones.within``."""
        for which, shape in self._by_shape(np.arange(len(self)))[2:]:
            if which[k]:
                point: np.ndarray = shape.within(k, unit)
                return point
        begin = (self.near[k] / self.range_m[k]) ** 3
        deep = np.column_stack([begin + (1 - begin) * unit[:, 0], unit[:, 1:]])
        return super().within(k, deep)


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
