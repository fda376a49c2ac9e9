"""Bounds of the covered and the uncovered volume of a target, summed over cells."""

from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float, Int, UInt8

from ..solids.volume_fraction import VolumeFraction

LEVELS = 19  # of cell halving, from the scene's box down to the smallest cell
_SUM = 1e-12  # relative rounding error of a sum of volumes; adding such sums increases it


OUTSIDE, COVERED, UNCOVERED, OPEN = range(4)
"""What is known of a settled cell: it lies wholly outside the target, or in it and in what is seen,
or in it and not in what is seen; or only bounds of its shares are known."""


@dataclass(frozen=True, eq=False)
class SettledCells:
    """The cells of the last pass, in the order of their keys."""

    unit: float
    """Side of a cell of level 0, m."""
    level: UInt8[np.ndarray, " C"]
    """Levels; a cell's side is 2^level units."""
    key: Int[np.ndarray, " C"]
    """First keys."""
    state: UInt8[np.ndarray, " C"]
    """What is known of each."""


@dataclass(frozen=True)
class Bracket:
    """Guaranteed bounds of zeta and of the target's volume, and how they were reached."""

    low: float
    """Lower bound of zeta, in [0, 1]."""
    high: float
    """Upper bound of zeta, in [0, 1]."""
    volume_low: float
    """Lower bound of the target's volume, m^3."""
    volume_high: float
    """Upper bound of the target's volume, m^3."""
    passes: int
    """Number of passes."""
    cells: int
    """Cells settled in the last pass."""
    smallest: float
    """Side of the smallest of these cells, m."""
    reached: bool
    """Whether the interval has the requested width."""
    settled: SettledCells | None = None
    """The cells, if they were to be kept."""

    @property
    def width(self) -> float:
        """Width of the interval, in [0, 1]."""
        return self.high - self.low

    def widened(self, share: float) -> "Bracket":
        """Return the interval with a share of its width more at each end."""
        more = share * self.width
        return replace(self, low=max(self.low - more, 0.0), high=min(self.high + more, 1.0))


@dataclass
class VolumeTally:
    """Bounds of the covered and the uncovered volume of the target."""

    volumes: Float[np.ndarray, " 4"] = field(default_factory=lambda: np.zeros(4))
    """Lower and upper bound of the covered volume, and both of the uncovered one, m^3."""
    cells: int = 0
    """Number of settled cells."""
    level: int = LEVELS + 2
    """Smallest level of a settled cell."""
    sums: int = 0
    """Number of sums."""
    settled: list[tuple[int, np.ndarray, np.ndarray]] = field(default_factory=list)
    """Level, keys and states of cells that are kept."""

    def add(
        self, covered: VolumeFraction, uncovered: VolumeFraction, volume: float, level: int
    ) -> None:
        """Settle cells of volume ``volume`` m^3 each."""
        bounds = (covered.low, covered.high, uncovered.low, uncovered.high)
        sums, cells = volume * np.array([v.sum() for v in bounds]), len(covered.low)
        self.join(VolumeTally(sums, cells, level if cells else self.level, 1))

    def join(self, other: "VolumeTally") -> None:
        """Add the cells that another thread settled."""
        self.volumes = self.volumes + other.volumes
        self.cells += other.cells
        self.level = min(self.level, other.level)
        self.sums += other.sums
        self.settled += other.settled

    def bracket(self, passes: int, unit: float, width: float) -> Bracket:
        """Return the interval; sums are widened by their rounding error."""
        rounding = _SUM + self.sums * 2.0**-52
        c, u = (self.volumes[::2] * (1 - rounding)).tolist()
        more_c, more_u = (self.volumes[1::2] * (1 + rounding)).tolist()
        kept = self._kept(unit) if self.settled else None
        low = c / (c + more_u) * (1 - _SUM) if c > 0 else 0.0
        high = min(more_c / (more_c + u) * (1 + _SUM), 1.0) if more_c > 0 else 0.0
        return Bracket(
            low,
            high,
            c + u,
            more_c + more_u,
            passes,
            self.cells,
            unit * 2.0**self.level,
            high - low <= width,
            kept,
        )

    def _kept(self, unit: float) -> SettledCells:
        levels = [np.full(len(key), level, np.uint8) for level, key, _ in self.settled]
        level = np.concatenate(levels)
        key, state = (np.concatenate([cells[i] for cells in self.settled]) for i in (1, 2))
        order = np.argsort(key)
        return SettledCells(unit, level[order], key[order], state[order].astype(np.uint8))
