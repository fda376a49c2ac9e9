"""How a Time-of-Flight sensor errs about the true distance: noise, whole millimetres, readings that
are lost.

A ranging error of 20 mm in the dark is told of the VL53L1X: the sum of an offset, which stays, and
of the scatter from reading to reading (user's manual of the STEBCN2V1). The defaults take 5 mm of
scatter near by and 1 % of the distance far off; the offset is a matter of each ring (see
``World``). They are assumptions: a self check measures the real scatter.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from .readings import NO_TARGET, VALID


@dataclass(frozen=True)
class Noise:
    """sigma: m, standard deviation near by. share: of the distance, added in quadrature. quantum:
    m, step of what is told. lost: share of readings that are lost, and tell of no target.

    Raises:
        ValueError: if one is negative or ``lost`` is 1 or more.
    """

    sigma: float = 0.005
    share: float = 0.01
    quantum: float = 0.001
    lost: float = 0.02

    def __post_init__(self) -> None:
        for key, value in vars(self).items():
            if not 0 <= value < (1 if key == "lost" else np.inf):
                raise ValueError(
                    f"noise: {key}: found {value:g}, allowed: 0 and"
                    f" more{', below 1' * (key == 'lost')}"
                )

    def at(self, distance: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
        """Standard deviation (...) m of a reading at a distance (...) m, rounding to a quantum
        counted in.
        """
        return np.sqrt(self.sigma**2 + (self.share * distance) ** 2 + self.quantum**2 / 12)

    def measured(
        self, rng: np.random.Generator, distance: Float[np.ndarray, "*n"]
    ) -> tuple[Float[np.ndarray, "*n"], Int[np.ndarray, "*n"]]:
        """A reading (...) m and its status (...) for each true distance, nan and no target where
        that is infinite.
        """
        seen = np.isfinite(distance) & (rng.random(distance.shape) >= self.lost)
        exact = np.where(seen, distance, 0.0)
        told = exact + rng.normal(size=distance.shape) * np.hypot(self.sigma, self.share * exact)
        if self.quantum > 0:
            told = np.round(told / self.quantum) * self.quantum
        return np.where(seen, np.maximum(told, 0.0), np.nan), np.where(seen, VALID, NO_TARGET)
