"""The result of a search, as Python has it and as files state it."""

from dataclasses import dataclass
from dataclasses import field as _field
from typing import Annotated, Any

from pydantic import Field, PlainSerializer, PlainValidator

from ...coverage.choices import Losing
from ...coverage.definitions.definition import definition, fault
from ...coverage.definitions.field_types import InPython, Items
from ...coverage.definitions.records import JsonRecord
from ...coverage.definitions.units import Covered, Decimals, Points
from ...coverage.detection.detection import Detection
from ...coverage.rings.mounting_errors import Mountings
from ...coverage.rings.ring import Setup
from ...objectives.prices import SetupPrice
from ...objectives.verified import Verified
from .progress import Outcome, StageResult

_Exact = Annotated[float, Covered("exact_percent")]
_Short = Annotated[float, Points("short_percent", 16)]
_Seconds = Annotated[float, Decimals(1)]


def _outcome(text: Any) -> Outcome | str:
    if not isinstance(text, str):
        raise fault(text, "text")
    return next((outcome for outcome in Outcome if outcome == text), text)


@definition(kw_only=True)
class SearchResult(JsonRecord):
    """The search that produced a proposal.

    After Ctrl-C during the final count, ``exact`` is a rough value from coarser voxels and a subset
    of the poses.
    """

    setup: InPython[Setup] = None  # type: ignore[assignment]
    """The best setup; None from a file."""
    outcome: Annotated[
        Outcome,
        PlainValidator(_outcome, json_schema_input_type=str),
        PlainSerializer(str, return_type=str),
    ]
    """How the search ended; from a file of another version, its text."""
    seed: int
    """Random seed."""
    sampled: Annotated[float, Covered("soft_percent")] | None = None
    """Criterion on the search's sample points, over the poses the mean or the worst, as the scene
    states; from ``improve`` a soft one. None where a floor is missed, which lowers it, and with a
    largest gap."""
    exact: _Exact
    """Exact value of the criterion."""
    width: float = 0.0
    """Width of the sigmoid of the value on sample points, m; 0 if it is a share of the points."""
    starts: int
    """Number of starts."""
    evaluations: int = 0
    """Evaluations of the soft coverage's gradient by local searches."""
    stages: Items[StageResult] = ()
    """Stages of the search."""
    slope: Annotated[float, Points("", 4)] | None = None
    """Norm of the gradient at the end of the local stage, less what the rules forbid to follow, in
    shares of the target by mm along the links and degrees; in files, points."""
    seconds: _Seconds
    """Wall-clock time, s."""
    start_up: Annotated[float, Decimals(1, "start_up_seconds")] = 0.0
    """Part of it before the search began, which a cap does not cut, s."""
    counting: Annotated[float, Decimals(1, "count_seconds")] = 0.0
    """Part of it for the final count, which a cap does not cut, s."""
    command: str = ""
    """Command that wrote the file."""
    created: str = ""
    """Time of creation, UTC."""
    versions: dict[str, str] = _field(default_factory=dict)
    """Versions of the relevant packages."""
    redundancy: Annotated[int, Field(ge=1)] = 1
    """Number of sensors that must see a point."""
    losing: Losing | None = None
    """Part whose worst loss the criterion assumes."""
    tolerant: Mountings | None = None
    """Mounting errors in the criterion."""
    detection: Detection | None = None
    """What is to be detected, in the criterion."""
    bound: Annotated[float, Points("bound_percent", 2)] | None = None
    """Upper bound of the criterion for every layout of the same budget."""
    short: InPython[float] = 0.0
    """Sum by which the exact values miss the goals' floors."""
    excess: InPython[float] = 0.0
    """Sum by which spheres that no sensor sees exceed the goals' largest gaps, as a share of each;
    not searched with many poses, nor for other criteria than ζ."""
    voxel: InPython[float] = 0.01
    """Side of the voxels of the count, m."""
    verified: InPython[tuple[Verified, ...]] = ()
    """Exact ζ of each goal, where ζ is the criterion and its count was not rough."""
    price: InPython[SetupPrice | None] = None
    """Price of the setup; None without prices."""

    @property
    def rank(self) -> tuple[float, float]:
        """Sort key, greater is better: missed floors and gaps first, then the exact value."""
        return -self.missed, self.exact

    @property
    def missed(self) -> float:
        """What the goals' floors and largest gaps lack, in sum of shares."""
        return self.short + self.excess

    @property
    def cut(self) -> bool:
        """Whether a limit or Ctrl-C ended the search before its schedule did."""
        return self.outcome is not Outcome.FINISHED


@definition(kw_only=True)
class SeedResult:
    """Result of one search of several with different random seeds."""

    seed: int
    """Random seed."""
    exact: _Exact
    """Exact value of the criterion."""
    short: _Short = 0.0
    """Sum by which floors are missed."""
    best: bool
    """Whether it is the answer."""
    seconds: _Seconds
    """Wall-clock time, s."""


@dataclass(frozen=True)
class RepeatedSearch:
    """The results of several searches."""

    result: SearchResult
    """The best result. Its outcome is that of the last search."""
    tried: dict[int, SearchResult]
    """Result of each search by its seed."""

    @property
    def records(self) -> list[SeedResult]:
        """The record of each search."""
        return [
            SeedResult(
                seed=seed,
                exact=r.exact,
                short=r.short,
                best=seed == self.result.seed,
                seconds=r.seconds,
            )
            for seed, r in self.tried.items()
        ]


@definition
class SensorsTried:
    """Result of the search with one sensor count."""

    sensors: int
    """Number of sensors."""
    exact: _Exact
    """Exact value of the criterion."""
    reached: bool
    """Whether the coverage and all floors are reached."""


@definition(kw_only=True)
class Reach:
    """Results of the searches for the fewest sensors."""

    wanted: Annotated[float, Covered("wanted_percent")]
    """Target value of the criterion."""
    reached: bool
    """Whether any sensor count reaches it."""
    tried: Items[SensorsTried]
    """Results by sensor count."""
    result: InPython[SearchResult] = None  # type: ignore[assignment]
    """The result with the fewest sensors that reaches the coverage; if none does, the best one."""


@definition(kw_only=True)
class RingsTried:
    """Result of the search with one number of rings."""

    rings: int
    """Number of rings; fixed ones count too."""
    exact: _Exact
    """Exact value of the criterion."""
    within: bool
    """Whether it is within the margin of the best."""
    price: float | None = None
    """Price of the setup, by the scene."""
    seconds: _Seconds
    """Duration of its search, s."""
    finished: bool
    """Whether its search ended by itself, not by a limit."""


@definition(kw_only=True)
class FewestRings:
    """Results of the searches for the fewest rings."""

    within: Annotated[float, Points("within_points", 9)]
    """Margin: largest loss against the best."""
    tried: Items[RingsTried] = ()
    """Results by number of rings."""
    conclusive: bool = False
    """Whether the searches for the best and for one ring fewer than the answer ended by
    themselves."""
    untried: Items[int] = ()
    """Smaller numbers of rings for which no time was left."""
    result: InPython[SearchResult] = None  # type: ignore[assignment]
    """The result with the fewest rings within the margin."""
    results: InPython[dict[int, SearchResult]] = _field(default_factory=dict)
    """The result with each number of rings, ascending."""
    too_few: InPython[int] = 0
    """A number of rings that the rules do not allow for the sensors, nor fewer."""

    def __post_init__(self) -> None:
        """State what follows from the results, if they are given."""
        if not (results := self.results):
            return
        fewest = self.fewest
        short = max([self.too_few, *(n for n in results if n < fewest)])
        # the searches on which the answer rests
        decide = {max(results), len(self.best.setup.rings), fewest - 1} & {*results}
        untried = tuple(range(short + 1, fewest))
        conclusive = not untried and not any(results[n].cut for n in decide)
        tried = tuple(
            RingsTried(
                rings=n,
                exact=r.exact,
                within=self.suffices(r),
                price=r.price.total if r.price else None,
                seconds=r.seconds,
                finished=not r.cut,
            )
            for n, r in results.items()
        )
        vars(self).update(tried=tried, untried=untried, conclusive=conclusive)

    @property
    def best(self) -> SearchResult:
        """The result with the highest exact value."""
        return max(self.results.values(), key=lambda result: result.rank)

    @property
    def fewest(self) -> int:
        """The smallest number of rings within the margin."""
        return min(n for n, result in self.results.items() if self.suffices(result))

    def doubtful(self, left: float) -> tuple[int, ...]:
        """The number of rings below the answer, if a limit cut its search short although it would
        now have longer; ``left``: the time that is left, s."""
        result = self.results.get(number := self.fewest - 1)
        return (number,) if result is not None and result.cut and left > result.seconds else ()

    def suffices(self, result: SearchResult) -> bool:
        """Return whether a result is within the margin of the best, and misses floors and gaps no
        more."""
        best = self.best
        return result.missed <= best.missed and result.exact >= best.exact - self.within
