"""Guaranteed bounds of the shares of cubes that lie in solids, and how they combine.

The bounds hold for any overlap of the solids. ``a or b`` is at least the larger share and at most
the sum. ``a and b`` is at least the excess of the sum over 1 and at most the smaller share.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int


@dataclass(frozen=True)
class VolumeFraction:
    """Bounds low <= share <= high of N cubes."""

    low: Float[np.ndarray, " N"]
    """Lower bounds, in [0, 1]."""
    high: Float[np.ndarray, " N"]
    """Upper bounds, in [0, 1]."""

    def __neg__(self) -> "VolumeFraction":
        """Return bounds of the share outside."""
        return VolumeFraction(1.0 - self.high, 1.0 - self.low)

    def __or__(self, other: "VolumeFraction") -> "VolumeFraction":
        """Return bounds of the share in the union."""
        return VolumeFraction(
            np.maximum(self.low, other.low), np.minimum(self.high + other.high, 1.0)
        )

    def __and__(self, other: "VolumeFraction") -> "VolumeFraction":
        """Return bounds of the share in the intersection."""
        return VolumeFraction(
            np.maximum(self.low + other.low - 1.0, 0.0), np.minimum(self.high, other.high)
        )

    def only(self, keep: Bool[np.ndarray, " N"] | Int[np.ndarray, " M"]) -> "VolumeFraction":
        """Return the shares of some cubes, selected by truth values or by indices."""
        return VolumeFraction(self.low[keep], self.high[keep])

    def cut(
        self, keep: Bool[np.ndarray, " N"] | Int[np.ndarray, " M"], other: "VolumeFraction"
    ) -> None:
        """Replace the shares of some cubes by those of the intersections with ``other``."""
        both = self.only(keep) & other
        self.low[keep], self.high[keep] = both.low, both.high
