"""What the optics of sensors see, before anything stands in the way: cones and pyramids, both in
one setup.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from ..arrays import Array, namespace, rows
from ..trees import mapped, tree
from .cones import Cones, cone
from .pyramids import Pyramids, pyramid
from .volume_fraction import VolumeFraction


@tree
@dataclass(frozen=True)
class Optics(Cones):
    """Cones of which some are pyramids, numbered together: a part with half_up (K,) rad above 0 is
    a pyramid, whose ``up`` (K, 3) is a unit vector across its axis; of the others ``up`` says
    nothing. Each part has the function of its shape, so the union is 1-Lipschitz. zoned (K,): is it
    read zone by zone, so that what stands in some leaves the others as they are?"""

    up: Float[Array, "K 3"]
    half_up: Float[Array, " K"]
    zoned: Bool[Array, " K"]

    def part(self, points: Any, index: Any) -> Any:
        half, half_up, range_m = self.half_angle[index], self.half_up[index], self.range_m[index]
        apex, axis, up = (rows(a, index) for a in (self.apex, self.axis, self.up))
        return beam(points, apex, axis, half, range_m, up, half_up)

    def _by_shape(self, index: Any) -> tuple[tuple[Any, Cones | Pyramids], ...]:
        """Which pairs have which shape, and the union of that shape; both numbered as here."""
        square = np.asarray(self.half_up)[index] > 0
        round_ = Cones(self.apex, self.axis, self.half_angle, self.range_m)
        square_ = Pyramids(
            self.apex, self.axis, self.half_angle, self.range_m, self.up, self.half_up
        )
        return (~square, round_), (square, square_)

    def split(self, index: Any, work: Callable[[Any, Any], Any]) -> list[Any]:
        """``work(which pairs, union)`` for each of the shapes that occur among pairs of part
        ``index`` (P,).
        """
        return [
            work(np.flatnonzero(which), parts)
            for which, parts in self._by_shape(index)
            if which.any()
        ]

    def each_share(
        self, points: Any, index: Any, side: float, slack: float
    ) -> tuple[VolumeFraction, Any, Any]:
        """See ``Cones.each_share``: each pair by its shape."""
        n = len(index)
        share, value, normal = (
            VolumeFraction(np.zeros(n), np.zeros(n)),
            np.zeros(n),
            np.zeros((n, 3)),
        )

        def fill(k: Any, shape: Cones | Pyramids) -> None:
            found, value[k], normal[k] = shape.each_share(rows(points, k), index[k], side, slack)
            share.low[k], share.high[k] = found.low, found.high

        self.split(index, fill)
        return share, value, normal

    def around(self) -> Cones:
        """The narrowest cones that hold the beams: through a pyramid's corners."""
        xp = namespace(self.half_up)
        corner = xp.arctan(xp.hypot(xp.tan(self.half_angle), xp.tan(self.half_up)))
        return Cones(
            self.apex, self.axis, xp.where(self.half_up > 0, corner, self.half_angle), self.range_m
        )

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        square = np.asarray(self.half_up) > 0
        boxes = []
        for which, parts in self._by_shape(np.arange(len(self))):
            if which.any():
                boxes.append(mapped(lambda a, which=which: np.asarray(a)[which], parts).bounds())
        return (
            np.stack([np.min(boxes, axis=0)[0], np.max(boxes, axis=0)[1]])
            if len(square)
            else np.zeros((2, 3))
        )


def beam(points: Any, apex: Any, axis: Any, half: Any, range_m: Any, up: Any, half_up: Any) -> Any:
    """Implicit function of a cone, or of a pyramid where ``half_up`` is above 0; for the arguments
    see ``pyramid``.
    """
    xp = namespace(half_up)
    round_ = cone(points, apex, axis, xp.cos(half), xp.sin(half), range_m)
    return xp.where(half_up > 0, pyramid(points, apex, axis, up, half, half_up, range_m), round_)


def optics(
    apex: Any, axis: Any, half: Any, range_m: Any, up: Any, half_up: Any, zoned: Any
) -> Cones:
    """V_FOV of K sensors: plain cones where no beam is square, which are sooner counted. half_up
    None: there is none.
    """
    if half_up is None:
        return Cones(apex, axis, half, range_m)
    return Optics(apex, axis, half, range_m, up, half_up, zoned)
