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
    """Side of the voxels of the count, m."""
    verified: tuple[Verified, ...] = ()
    """Exact ζ of each goal, where ζ is the criterion and its count was not rough."""
    stages: tuple[StageResult, ...] = ()
    """What each stage of the search reached."""
    slope: float | None = None
    """Norm of the gradient that the local stage left, less what the rules forbid to follow, in
    shares of the target by mm along the links and degrees; None without a local stage."""

    @property
    def counting(self) -> float:
        """Wall-clock time of the exact count of the finalists, s; no limit cuts it."""
        return next((stage.seconds for stage in self.stages if stage.name == "verdict"), 0.0)

    @property
    def rank(self) -> tuple[float, float]:
        """Sort key, greater is better: missed floors first, then the exact value."""
        return -self.short, self.exact

    @property
    def cut(self) -> bool:
        """Whether a limit or Ctrl-C ended the search before its schedule did."""
        return self.outcome is not Outcome.FINISHED


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
    too_few: int = 0
    """A number of rings that the rules do not allow for the sensors, nor fewer."""

    @property
    def best(self) -> SearchResult:
        """The result with the highest exact value."""
        return max(self.tried.values(), key=lambda one: one.rank)

    @property
    def fewest(self) -> int:
        """The smallest number of rings within the margin."""
        return min(n for n, one in self.tried.items() if self.suffices(one))

    @property
    def untried(self) -> range:
        """The numbers of rings between the answer and the next smaller one that is known to fall
        short; empty where the answer minus one is known to."""
        fewest = self.fewest
        return range(max([self.too_few, *(n for n in self.tried if n < fewest)]) + 1, fewest)

    def doubtful(self, left: float) -> range:
        """The number of rings below the answer, if a limit cut its search short although it would
        now have longer; ``left``: the time that is left, s."""
        number = self.fewest - 1
        one = self.tried.get(number)
        again = one is not None and one.cut and left > one.statistics.seconds
        return range(number, number + again)

    @property
    def cut(self) -> list[int]:
        """The numbers of rings on whose searches the answer rests although a limit cut them short:
        the first, the best, and that with one ring less than the answer."""
        decide = {max(self.tried), len(self.best.setup.rings), self.fewest - 1}
        return [n for n in sorted(decide & {*self.tried}) if self.tried[n].cut]

    @property
    def conclusive(self) -> bool:
        """Whether all searches on which the answer rests ended by themselves."""
        return not self.cut and not self.untried

    def suffices(self, result: SearchResult) -> bool:
        """Return whether a result is within the margin of the best, and misses floors no more."""
        best = self.best
        return result.short <= best.short and result.exact >= best.exact - self.within
