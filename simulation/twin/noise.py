"""Noise model of a Time-of-Flight sensor: scatter, rounding to whole millimetres, lost readings.

The VL53L1X is specified with a ranging error of 20 mm in the dark: the sum of a constant offset and
of the scatter from reading to reading (user's manual of the STEBCN2V1). The defaults are 5 mm of
scatter at short distance and 1 % of a long distance; the offset belongs to each ring (see
``World``). These are assumptions: a self check measures the actual scatter.
"""

from typing import Annotated

import numpy as np
from jaxtyping import Float, Int
from pydantic import Field

from ...coverage.definitions.definition import definition
from ...formats.ring_status import Status

_Share = Annotated[float, Field(ge=0, le=1)]


@definition
class Noise:
    """Noise of a sensor's readings."""

    sigma: _Share = 0.005
    """Standard deviation at short distance, m."""
    share: _Share = 0.01
    """Standard deviation as a share of the distance, added in quadrature."""
    quantum: _Share = 0.001
    """Resolution of a reading, m."""
    lost: Annotated[float, Field(ge=0, lt=1)] = 0.02
    """Share of readings that are lost and report no target."""

    def at(self, distance: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
        """Return the standard deviation (...) m of a reading at a distance (...) m, including
        rounding.
        """
        return np.sqrt(self.sigma**2 + (self.share * distance) ** 2 + self.quantum**2 / 12)

    def measured(
        self, rng: np.random.Generator, distance: Float[np.ndarray, "*n"]
    ) -> tuple[Float[np.ndarray, "*n"], Int[np.ndarray, "*n"]]:
        """Return a random reading (...) m and its status (...) for each true distance; nan and no
        target where that is infinite.
        """
        seen = np.isfinite(distance) & (rng.random(distance.shape) >= self.lost)
        exact = np.where(seen, distance, 0.0)
        told = exact + rng.normal(size=distance.shape) * np.hypot(self.sigma, self.share * exact)
        if self.quantum > 0:
            told = np.round(told / self.quantum) * self.quantum
        status = np.where(seen, Status.VALID, Status.NO_TARGET)
        return np.where(seen, np.maximum(told, 0.0), np.nan), status


USUAL_NOISE = Noise()
"""The noise that plans and assessments assume."""
