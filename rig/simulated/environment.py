"""Environment of simulated rings, and the simplest one: distances that change smoothly with the
joints, for tests.
"""

from typing import Any, Protocol

import numpy as np
from jaxtyping import Float, Int

from ..rings.protocol import Status

# distances in m, nan without a target, of sensors (n,) or their zones (n, r, c, t); statuses
Measured = tuple[Float[np.ndarray, "*grid"], Int[np.ndarray, "*grid"]]
_NOISE = 0.003  # m


class Environment(Protocol):
    """Environment that the simulated rings see. ``counts`` holds the sensors of each ring."""

    counts: tuple[int, ...]

    def see(self, q: Float[np.ndarray, " 6"]) -> Any:
        """Return what is visible at joint angles ``q`` (6,) rad; the same for the same angles until
        a message arrives. It may be slow: it runs in a thread of its own.
        """
        ...

    def measure(self, seen: Any, rng: np.random.Generator) -> list[Measured]:
        """Return the noisy readings of each ring for a result of ``see``."""
        ...

    def tell(self, message: dict[str, Any]) -> None:
        """Receive a message, such as a new position of the rod."""
        ...


class PlainWorld:
    """``rings`` rings of ``sensors`` sensors. The distance of sensor s of ring r is 1 + 0.3
    sin(q·(1 … 6) + r + s) m.
    """

    def __init__(self, rings: int, sensors: int) -> None:
        self.counts = (sensors,) * rings

    def see(self, q: Float[np.ndarray, " 6"]) -> Float[np.ndarray, "r s"]:
        """Return the true distances, m."""
        ring, sensor = np.ogrid[: len(self.counts), : max(self.counts, default=0)]
        return 1 + 0.3 * np.sin(float(q @ np.arange(1, 7)) + ring + sensor)

    def measure(self, seen: Float[np.ndarray, "r s"], rng: np.random.Generator) -> list[Measured]:
        """Add 3 mm of noise; all readings are valid."""
        return [
            (true + rng.normal(0, _NOISE, true.shape), np.full(true.shape, Status.VALID))
            for true in seen
        ]

    def tell(self, message: dict[str, Any]) -> None:
        """Ignore messages."""
