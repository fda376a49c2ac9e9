"""Several searches with different random seeds, of which the best answer counts.

How far the answers lie apart shows what chance decides, and so what more time may add.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from .feasible_set import InfeasibleError
from .progress import Outcome, Progress
from .search import SearchResult

# runs one search: its seed, its limit in seconds, and what receives its progress
Run = Callable[[int, float, Callable[[Progress], None]], SearchResult]


@dataclass
class RepeatedProgress(Progress):
    """Progress of one search of several."""

    search: int = 1
    """Number of the search, from 1."""
    searches: int = 1
    """Number of all searches."""


@dataclass(frozen=True)
class RepeatedSearch:
    """The results of several searches."""

    result: SearchResult
    """The best result. Its outcome is that of the last search."""
    seed: int
    """Random seed of the best result."""
    tried: dict[int, SearchResult]
    """Result of each search by its seed."""


def repeated_search(
    run: Run,
    count: int,
    seed: int,
    time_cap: float = float("inf"),
    tell: Callable[[Progress], None] = lambda progress: None,
) -> RepeatedSearch:
    """Search with ``count`` seeds from ``seed`` on, one after the other; keep the best answer.

    The best misses the floors of the goals least, and then has the highest exact value. An answer
    that a stop cut short counts only if it is the only one with voxels as fine. Ctrl-C keeps the
    answers so far.

    Args:
        run: runs one search.
        count: number of searches, at least 1.
        seed: random seed of the first search.
        time_cap: limit in seconds for all; each search may use what is left.
        tell: receives the progress, in the calling thread.

    Raises:
        InfeasibleError: if no search found a setup that the rules admit.
    """
    if count < 1:
        raise ValueError(f"count must be at least 1, got {count}")
    began, tried, outcome = time.monotonic(), dict[int, SearchResult](), Outcome.FINISHED
    for number in range(1, count + 1):

        def of_one(progress: Progress, number: int = number) -> None:
            shown = replace(progress, best=max([progress.best, *(r.exact for r in tried.values())]))
            tell(RepeatedProgress(**vars(shown), search=number, searches=count))

        left = time_cap if number == 1 else time_cap - (time.monotonic() - began)
        if tried and left <= 0:
            outcome = Outcome.TIME
            break
        try:
            if tried:
                of_one(Progress())
            one = tried[seed + number - 1] = run(seed + number - 1, left, of_one)
        except InfeasibleError:  # of this seed: rings collided in every candidate
            if not tried and number == count:
                raise
            continue
        except KeyboardInterrupt:  # before the search had anything to return
            if not tried:
                raise
            outcome = Outcome.INTERRUPTED
            break
        if (outcome := one.outcome) is not Outcome.FINISHED:
            break
    finest = min(one.voxel for one in tried.values())
    best = max(tried, key=lambda s: (tried[s].voxel == finest, -tried[s].short, tried[s].exact))
    return RepeatedSearch(replace(tried[best], outcome=outcome), best, tried)
