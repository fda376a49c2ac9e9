"""Noise model of a Time-of-Flight sensor: scatter, rounding to whole millimetres, lost readings.

The VL53L1X is specified with a ranging error of 20 mm in the dark: the sum of a constant offset and
of the scatter from reading to reading (user's manual of the STEBCN2V1). The defaults are 5 mm of
scatter at short distance and 1 % of a long distance; the offset belongs to each ring (see
``World``). These are assumptions: a self check measures the actual scatter.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from .readings import NO_TARGET, VALID


@dataclass(frozen=True)
class Noise:
    """Noise of a sensor's readings.

    Raises:
        ValueError: if a value is negative or ``lost`` is 1 or more.
    """

    sigma: float = 0.005
    """Standard deviation at short distance, m."""
    share: float = 0.01
    """Standard deviation as a share of the distance, added in quadrature."""
    quantum: float = 0.001
    """Resolution of a reading, m."""
    lost: float = 0.02
    """Share of readings that are lost and report no target."""

    def __post_init__(self) -> None:
        for key, value in vars(self).items():
            if not 0 <= value < (1 if key == "lost" else np.inf):
                raise ValueError(
                    f"noise: {key}: found {value:g}, allowed: 0 and"
                    f" more{', below 1' * (key == 'lost')}"
                )

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
        return np.where(seen, np.maximum(told, 0.0), np.nan), np.where(seen, VALID, NO_TARGET)
