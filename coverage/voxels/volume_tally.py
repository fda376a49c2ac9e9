"""Bounds of the covered and the uncovered volume of a target, summed over cells."""

from dataclasses import dataclass

from ..solids.volume_fraction import VolumeFraction

LEVELS = 19  # of cell halving, from the scene's box down to the smallest cell
_SUM = 1e-12  # relative rounding error of a sum of volumes; adding such sums increases it


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

    @property
    def width(self) -> float:
        """Width of the interval, in [0, 1]."""
        return self.high - self.low


@dataclass
class VolumeTally:
    """Bounds of the covered and the uncovered volume of the target."""

    covered_low: float = 0.0
    """Lower bound of the covered volume, m^3."""
    covered_high: float = 0.0
    """Upper bound of the covered volume, m^3."""
    uncovered_low: float = 0.0
    """Lower bound of the uncovered volume, m^3."""
    uncovered_high: float = 0.0
    """Upper bound of the uncovered volume, m^3."""
    cells: int = 0
    """Number of settled cells."""
    level: int = LEVELS + 2
    """Smallest level of a settled cell."""
    sums: int = 0
    """Number of sums."""

    def add(
        self, covered: VolumeFraction, uncovered: VolumeFraction, volume: float, level: int
    ) -> None:
        """Settle cells of volume ``volume`` m^3 each."""
        sums = [
            volume * float(v.sum())
            for v in (covered.low, covered.high, uncovered.low, uncovered.high)
        ]
        cells = len(covered.low)
        covered_low, covered_high, uncovered_low, uncovered_high = sums
        level = level if cells else self.level
        self.join(
            VolumeTally(covered_low, covered_high, uncovered_low, uncovered_high, cells, level, 1)
        )

    def join(self, other: "VolumeTally") -> None:
        """Add the cells that another thread settled."""
        self.covered_low += other.covered_low
        self.covered_high += other.covered_high
        self.uncovered_low += other.uncovered_low
        self.uncovered_high += other.uncovered_high
        self.cells += other.cells
        self.level = min(self.level, other.level)
        self.sums += other.sums

    def bracket(self, passes: int, unit: float, width: float) -> Bracket:
        """Return the interval; sums are widened by their rounding error."""
        rounding = _SUM + self.sums * 2.0**-52
        c, u = self.covered_low * (1 - rounding), self.uncovered_low * (1 - rounding)
        more_c, more_u = self.covered_high * (1 + rounding), self.uncovered_high * (1 + rounding)
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
        )
