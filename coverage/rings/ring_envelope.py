"""The envelope of a mounted ring: one solid around its clamp, boards, plugs, lids, screws and
bolts.

The envelope is a union of hollow cylinders about the mount axis, all with the bore of the clamp. It
does not depend on the ring's phase: the parts between the boards and ears are included. It is
therefore larger than the ring, by a stated shape, and never smaller.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ..sensors.boards import PACKAGE
from .clamp import Clamp

# rad, of a split between sensors on either side: of three sensors, and less for more
_MOST_LEAN = math.pi / 6


@dataclass(frozen=True)
class Band:
    """A hollow cylinder of an envelope about the mount axis, m."""

    low: float
    """Lower end, from the plane of the lenses towards distal."""
    high: float
    """Upper end, from the plane of the lenses towards distal."""
    outer: float
    """Outer radius."""


@dataclass(frozen=True)
class Envelope:
    """The solid that a mounted ring occupies."""

    bore: float
    """Radius of the hole for the link, m."""
    bands: tuple[Band, ...]
    """The hollow cylinders."""

    @property
    def low(self) -> float:
        """Proximal end, from the plane of the lenses towards distal, m."""
        return min(band.low for band in self.bands)

    @property
    def high(self) -> float:
        """Distal end, from the plane of the lenses towards distal, m."""
        return max(band.high for band in self.bands)

    @property
    def outer(self) -> float:
        """Outer radius, m."""
        return max(band.outer for band in self.bands)

    @property
    def flipped(self) -> "Envelope":
        """The envelope of the same ring with its beams leaning the other way."""
        return Envelope(self.bore, tuple(Band(-b.high, -b.low, b.outer) for b in self.bands))

    def grown(self, by: float) -> "Envelope":
        """Return the envelope with its outside moved outwards by ``by`` m; the bore stays."""
        return Envelope(
            self.bore, tuple(Band(b.low - by, b.high + by, b.outer + by) for b in self.bands)
        )

    def __call__(self, points: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch"]:
        """Return the value (...) m of the envelope's implicit function at ``points`` (..., 3) m.

        Points are given in axis coordinates: the first along the mount axis from the plane of the
        lenses, the others across it. The function is a minimum of maxima of distances from planes
        and cylinders, hence 1-Lipschitz; outside it is at most the distance.
        """
        along, off = points[..., 0], np.hypot(points[..., 1], points[..., 2])
        values = [
            np.maximum.reduce([off - b.outer, self.bore - off, along - b.high, b.low - along])
            for b in self.bands
        ]
        nearest: np.ndarray = np.minimum.reduce(values)
        return nearest


def envelope_of(clamp: Clamp, leans_back: bool = False) -> Envelope:
    """Return the envelope of a clamp with its boards and bolts.

    Args:
        clamp: dimensions of the clamp.
        leans_back: whether the beams lean towards proximal, that is, whether the tilt is negative.
    """
    boards = _board_band(clamp)
    bolts = Band(min(clamp.foot, clamp.top), clamp.lug[1], clamp.bolted)
    envelope = Envelope(clamp.bore, (boards, bolts))
    return envelope.flipped if leans_back else envelope


def _board_band(clamp: Clamp) -> Band:
    """Return the band of blocks, boards, plugs, packages, lids and screw heads."""
    c, s, pocket = math.cos(clamp.tilt), math.sin(clamp.tilt), clamp.pocket
    board = pocket.board
    side, up = board.plugs
    half = board.width / 2 + abs(board.lens[0]) + side
    # up the board, ahead of the lens, half the width along the ring
    corners = [
        (u, v, half)
        for u in (pocket.low - up, pocket.high + up)
        for v in (-pocket.deep, -board.lens_height, clamp.on_board)
    ]
    corners += [(u, 0.0, PACKAGE[0] / 2) for u in (-PACKAGE[1] / 2, PACKAGE[1] / 2)]
    if (lid := pocket.lid) is not None:
        corners += [
            (u, v, lid.half) for u in (lid.low, lid.high) for v in (lid.back, clamp.in_front)
        ]
    heights = [v * s + u * c for u, v, _ in corners]
    radii = [math.hypot(clamp.radius + v * c - u * s, w) for u, v, w in corners]
    arms = clamp.collar / math.cos(_MOST_LEAN)
    radii += [math.hypot(clamp.outermost, clamp.half), arms]
    return Band(min(clamp.low, *heights), max(clamp.top, *heights), max(radii))


def hull(envelopes: Iterable[Envelope], margin: float = 0.0) -> Envelope:
    """Return an envelope that contains all ``envelopes``, of which each has equally many bands.

    Args:
        envelopes: at least one envelope.
        margin: distance by which the bands are enlarged, m.
    """
    some = list(envelopes)
    bands = tuple(
        Band(min(b.low for b in each), max(b.high for b in each), max(b.outer for b in each))
        for each in zip(*(e.bands for e in some), strict=True)
    )
    return Envelope(min(e.bore for e in some), bands).grown(margin)
