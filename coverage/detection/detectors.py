"""What sensors need to detect a test piece."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from ..arrays import Array


class Detectors(NamedTuple):
    """What K sensors need to detect a test piece, apart from their poses."""

    edge: Float[Array, "*batch K 2"]
    """Tangents of the half angles across ``up`` and along it; of a round beam, those of the square
    that is as large."""
    zones: Float[Array, "*batch K 2"]
    """Zones in a row, and rows."""
    round: Bool[Array, "*batch K"]
    """Which beams are round."""
    flat: Bool[Array, "*batch K"]
    """Which beams are cones or pyramids; the piece fills any other beam that it is in."""
    reach: Float[Array, "*batch K"]
    """Range R for the piece and the light, m; minus infinity or 0: a sensor that sees nothing."""
    least: Float[Array, "*batch K"]
    """Distance below which the sensor reports nothing, m."""
    quantile: Float[Array, "*batch K 2"]
    """z: standard normal quantile of the share of frames that report anything at R; for signals
    below 1, and from 1 on."""
    threshold: Float[Array, "*batch K 2"]
    """b: threshold over the noise's standard deviation; for signals below 1, and from 1 on. Both
    are equal but in bounds: below 1 a higher threshold reports less, above 1 a lower one."""
    offset: Float[Array, "*batch K"]
    """Signal that the cross-talk of a cover hides."""
    frames: Float[Array, "*batch K"]
    """Whole frames within the time that detection may take."""
    measured: Bool[Array, "*batch K"]
    """For which sensors measured rates replace the law."""
    ramps: Float[Array, "*batch K M 3"]
    """Ramps whose sum is p by measured rates: signal where one begins, 1 over its width, and its
    rise; M may be 0."""

    @property
    def middle(self) -> Float[np.ndarray, "*batch K 2"]:
        """Tangents of the middle of the zone nearest to the axis; NumPy only."""
        edge, zones = np.asarray(self.edge), np.asarray(self.zones)
        middle: np.ndarray = np.where(zones % 2 == 0, edge / zones, 0.0)
        return middle
