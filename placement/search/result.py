"""The result of a search."""

from dataclasses import dataclass

from ...coverage.rings.ring import Setup
from ...objectives.verified import Verified
from .progress import Outcome, StageResult, Statistics


@dataclass(frozen=True)
class SearchResult:
    """The setup that a search returns, with its values and statistics.

    After Ctrl-C during the final count, ``exact`` is a rough value from coarser voxels and a subset
    of the poses.
    """

    setup: Setup
    """The best setup."""
    sampled: float | None
    """Value of the criterion on the sample points: weighted mean in [0, 1], over the poses the mean
    or the worst, as the scene states; from ``improve`` a soft one. None where a floor is missed,
    which lowers the criterion."""
    exact: float
    """Exact value of the criterion, defined as ``sampled`` is."""
    short: float
    """Sum by which the exact values miss the goals' floors."""
    outcome: Outcome
    """How the search ended."""
    statistics: Statistics
    """Effort of the search."""
    voxel: float = 0.01
    """Side of the voxels of the exact count, m."""
    verified: tuple[Verified, ...] = ()
    """Exact ζ of each goal, where ζ is the criterion and its count was not rough."""
    stages: tuple[StageResult, ...] = ()
    """What each stage of the search reached."""
    slope: float | None = None
    """Norm of the gradient that the local stage left, less what the rules forbid to follow, in
    shares of the target by mm along the links and degrees; None without a local stage."""

    @property
    def rank(self) -> tuple[float, float]:
        """Sort key, greater is better: missed floors first, then the exact value."""
        return -self.short, self.exact


@dataclass(frozen=True)
class RepeatedSearch:
    """The results of several searches."""

    result: SearchResult
    """The best result. Its outcome is that of the last search."""
    seed: int
    """Random seed of the best result."""
    tried: dict[int, SearchResult]
    """Result of each search by its seed."""


@dataclass(frozen=True)
class Reach:
    """Result of a search for the fewest sensors."""

    result: SearchResult
    """The result with the fewest sensors that reaches the coverage; if none does, the best one."""
    reached: bool
    """Whether the coverage and all floors are reached."""
    tried: dict[int, tuple[float, bool]]
    """For each sensor count tried: the exact value in [0, 1], and whether it reaches the coverage
    and all floors."""


@dataclass(frozen=True)
class FewestRings:
    """Result of a search for the fewest rings."""

    result: SearchResult
    """The result with the fewest rings among those within the margin."""
    within: float
    """The margin: the largest loss of exact value against the best, in [0, 1]."""
    tried: dict[int, SearchResult]
    """The result with each number of rings, ascending; fixed rings count too."""

    @property
    def best(self) -> SearchResult:
        """The result with the highest exact value."""
        return max(self.tried.values(), key=lambda one: one.rank)

    def suffices(self, result: SearchResult) -> bool:
        """Return whether a result is within the margin of the best, and misses floors no more."""
        best = self.best
        return result.short <= best.short and result.exact >= best.exact - self.within
