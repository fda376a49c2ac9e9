"""What simulated rings see, and the plainest of it: distances that change smoothly with the joints,
for tests.
"""

from typing import Any, Protocol

import numpy as np
from jaxtyping import Float, Int

from ..rings.protocol import Status

# distances, m, nan where there is none; statuses
Measured = tuple[Float[np.ndarray, " n"], Int[np.ndarray, " n"]]
_NOISE = 0.003  # m


class Environment(Protocol):
    """What the simulated rings see. counts: sensors of each ring."""

    counts: tuple[int, ...]

    def see(self, q: Float[np.ndarray, " 6"]) -> Any:
        """What there is to be seen at joint angles ``q`` (6,) rad: the same for the same ones,
        until something is told. May take its time: it is called in a thread of its own."""
        ...

    def measure(self, seen: Any, rng: np.random.Generator) -> list[Measured]:
        """What each ring's sensors say of what ``see`` gave, noise and all."""
        ...

    def tell(self, message: dict[str, Any]) -> None:
        """Something happened, such as a rod that was put somewhere."""
        ...


class PlainWorld:
    """``rings`` rings of ``sensors`` sensors. Sensor s of ring r is 1 + 0.3 sin(q·(1 … 6) + r + s)
    m from something.
    """

    def __init__(self, rings: int, sensors: int) -> None:
        self.counts = (sensors,) * rings

    def see(self, q: Float[np.ndarray, " 6"]) -> Float[np.ndarray, "r s"]:
        """True distances, m."""
        ring, sensor = np.ogrid[: len(self.counts), : max(self.counts, default=0)]
        return 1 + 0.3 * np.sin(float(q @ np.arange(1, 7)) + ring + sensor)

    def measure(self, seen: Float[np.ndarray, "r s"], rng: np.random.Generator) -> list[Measured]:
        """With 3 mm of noise; all are valid."""
        return [
            (true + rng.normal(0, _NOISE, true.shape), np.full(true.shape, Status.VALID))
            for true in seen
        ]

    def tell(self, message: dict[str, Any]) -> None:
        """Nothing changes this world."""
