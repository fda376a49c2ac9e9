"""What an upper bound on the coverage of every layout states. It loads no SciPy, as records do."""

from dataclasses import dataclass

NOTHING = 0.9995
"""A bound of at least this says nothing."""


@dataclass(frozen=True)
class TermBound:
    """Bound of the coverage of one target at one pose."""

    goal: int
    """Number of the target in the scene."""
    pose: int
    """Number of the pose."""
    by_volume: float
    """Bound by the volume of the beams, in [0, 1]."""
    by_prices: float
    """Bound by prices, in [0, 1]; 1 without, or where no prices are known to beat the volume."""

    @property
    def value(self) -> float:
        """The lower of the two."""
        return min(self.by_volume, self.by_prices)


@dataclass(frozen=True)
class CoverageBound:
    """Upper bound on the coverage of every layout within a budget."""

    value: float
    """Bound of the search's criterion, in [0, 1]."""
    terms: tuple[TermBound, ...]
    """Bound for each target at each pose."""
    seconds: float
    """Time that it took, s."""

    @property
    def informative(self) -> bool:
        """Whether it excludes anything: whether it lies below 100 %."""
        return self.value < NOTHING
