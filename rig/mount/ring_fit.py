"""Estimated mounting of a ring, with its uncertainty."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, Int
from scipy import stats

from ...coverage.rings.ring import Ring
from .channel_assignment import Order
from .mounting_error_model import LIMITS, NAMES
from .zone_turns import ZoneTurns

CONFIDENCE = 0.95


@dataclass(frozen=True)
class RingFit:
    """Estimated mounting of a ring with p free errors and n wires."""

    nominal: Ring
    """The ring as proposed."""
    ring: Ring
    """The ring as built."""
    names: tuple[str, ...]
    """The estimated errors."""
    values: Float[np.ndarray, " p"]
    """Estimates, m and rad."""
    covariance: Float[np.ndarray, "p p"]
    """Covariance of the estimates."""
    used: int
    """Number of readings used."""
    scale: float
    """Scale of the residuals, in standard deviations of the noise model."""
    order: Order
    """Order of the wires."""
    seat: Int[np.ndarray, " n"]
    """Seat of each wire."""
    mixed: tuple[tuple[int, ...], ...]
    """Wires whose seat differs from the order."""
    dead: tuple[int, ...]
    """Wires that report nothing, or always the same."""
    zones: ZoneTurns | None = None
    """How the zone grids arrive; None for sensors of one zone, or without readings of zones."""
    misfits: Mapping[int, str] = field(default_factory=dict)
    """What is mixed in the grids that fit no turn and no mirror, by wire; empty if it is unknown.
    With one of them, nothing is estimated: there are no values, and ``ring`` is as proposed."""
    unfit: str = ""
    """Why nothing is estimated, with advice, although no grid is mixed; empty if something is."""

    @staticmethod
    def none(ring: Ring, dead: tuple[int, ...], why: str) -> "RingFit":
        """Return a fit of a ring whose readings determine nothing: it is as proposed."""
        order, nothing = Order(), np.zeros(0)
        seat, none = order.seat(ring.count), np.zeros((0, 0))
        return RingFit(ring, ring, (), nothing, none, 0, 0.0, order, seat, (), dead, None, {}, why)

    @property
    def offset(self) -> float:
        """What its sensors read too much, m; 0 if it is not estimated."""
        return float(self.values[self.names.index("offset")]) if self.names else 0.0

    @property
    def freedom(self) -> int:
        """Degrees of freedom of the residuals."""
        return self.used - len(self.names)

    def margins(self) -> Float[np.ndarray, " p"]:
        """Return the margin of each value on its own, m and rad, by Student's t."""
        margin: np.ndarray = stats.t.ppf((1 + CONFIDENCE) / 2, self.freedom) * np.sqrt(
            np.diag(self.covariance)
        )
        return margin

    def statistic(self, truth: Float[np.ndarray, " p"]) -> float:
        """Return the squared Mahalanobis distance of ``truth`` (p,) from the values, divided by p;
        it follows the F distribution.
        """
        off = truth - self.values
        return float(off @ np.linalg.solve(self.covariance, off)) / len(off)

    def holds(self, truth: Float[np.ndarray, " p"], confidence: float = CONFIDENCE) -> bool:
        """Whether the joint confidence region of all values, an ellipsoid by the F distribution,
        contains ``truth`` (p,).
        """
        return bool(
            self.statistic(truth) <= stats.f.ppf(confidence, len(self.values), self.freedom)
        )

    @property
    def open(self) -> tuple[str, ...]:
        """Errors that the readings do not determine to within what careful mounting keeps."""
        return tuple(
            name
            for name, m in zip(self.names, self.margins(), strict=True)
            if not m <= LIMITS[NAMES.index(name)]
        )
