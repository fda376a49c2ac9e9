"""Several searches that follow each other: with other random seeds, for the fewest sensors that
reach a coverage, and for the fewest rings near the best coverage."""

import math
import time
from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import replace

from ...coverage.rings.ring import Setup
from ...objectives.criterion import Criterion
from ...objectives.scene import CoreScene
from ...objectives.verify import Verifier
from ..space.design import Space
from ..space.feasible_set import InfeasibleError
from .exchange_points import Fields
from .global_stage import Schedule, judging_points, usual
from .gradient_stage import Device
from .progress import Outcome, Progress, RepeatedProgress
from .result import FewestRings, Reach, RepeatedSearch, SearchResult
from .search import search

WITHIN = 0.01  # default margin of the fewest rings, share of a target
_STARTS = 3  # earlier results from which a search starts
_SENSORS, _GROWTH = 24, 1.6  # sensors of the first search; factor until a number suffices
_MOST = 2000  # sensors
_FIRST = 0.5  # share of the time of the search that chooses the number of rings
# runs one search: its seed, its limit in seconds, and what receives its progress
Run = Callable[[int, float, Callable[[Progress], None]], SearchResult]


def repeated_search(
    run: Run,
    count: int,
    seed: int,
    time_cap: float = math.inf,
    tell: Callable[[Progress], None] = lambda progress: None,
) -> RepeatedSearch:
    """Search with ``count`` seeds from ``seed`` on, one after the other; keep the best answer.

    The best misses the floors of the goals least, and then has the highest exact value. An answer
    that a stop cut short counts only if it is the only one with voxels as fine. Ctrl-C keeps the
    answers so far. How far the answers lie apart shows what chance decides.

    Args:
        run: runs one search.
        count: number of searches, at least 1.
        seed: random seed of the first search.
        time_cap: limit in seconds for all; each search may use what is left.
        tell: receives the progress.

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
    best = max(tried, key=lambda s: (tried[s].voxel == finest, *tried[s].rank))
    return RepeatedSearch(replace(tried[best], outcome=outcome), best, tried)


def fewest_sensors(
    scene: CoreScene,
    wanted: float,
    seed: int = 0,
    time_cap: float = math.inf,
    schedule: Schedule | None = None,
    voxel: float = 0.01,
    tell: Callable[[int, Progress], None] = lambda sensors, progress: None,
    aim: Criterion | None = None,
    rings: int | None = None,
) -> Reach:
    """Find a setup with few sensors whose exact value is at least ``wanted``.

    The sensor count grows until a search reaches ``wanted``, then shrinks by bisection until a
    search with one sensor fewer does not. This does not prove that fewer are impossible: searches
    find good setups, not bounds.

    Args:
        scene: robot, poses, goals, rules; its fixed rings count too.
        wanted: weighted mean of ζ over the goals, in (0, 1); floors of goals hold besides.
        seed: random seed of all searches.
        time_cap: limit in seconds from the call; then the best result so far is returned.
        schedule: schedule of each search.
        voxel: side of the voxels of the count, m.
        tell: receives the sensor count and the progress of its search.
        aim: the criterion that must reach ``wanted``; by default ζ itself.
        rings: number of rings, fixed ones included; by default each search chooses it.

    Raises:
        InfeasibleError: if the rules allow no setup at all.
        ValueError: if ``wanted`` is not in (0, 1), or a target is empty.
    """
    if not 0 < wanted < 1:
        raise ValueError(f"wanted must be between 0 and 1, got {wanted}")

    def suffices(result: SearchResult) -> bool:
        return result.short == 0 and result.exact >= wanted

    began, known, outcome = time.monotonic(), list[Setup](), Outcome.FINISHED
    allowed, results = allowed_totals(scene, rings), dict[int, SearchResult]()
    # indices of the largest count that falls short and of the smallest that suffices
    short, enough = -1, len(allowed)
    at = min(bisect_left(allowed, _SENSORS), len(allowed) - 1)
    while enough - short > 1:
        left, sensors = time_cap - (time.monotonic() - began), allowed[at]
        if results and left <= 0:
            outcome = Outcome.TIME
            break

        def report(progress: Progress, count: int = sensors) -> None:
            tell(count, progress)

        try:
            space = Space(scene, sensors=sensors, rings=rings)
            found = search(scene, space, seed, left, schedule, voxel, report, known, aim)
        except InfeasibleError:  # rings that collide
            if not results:
                raise
            if enough == len(allowed):
                break
            short = at
        else:
            results[sensors], outcome = found, found.outcome
            known = [found.setup, *known][:_STARTS]
            short, enough = (short, at) if suffices(found) else (at, enough)
            if outcome is not Outcome.FINISHED:
                break
        at = (short + enough) // 2
        if enough == len(allowed):
            grown = bisect_left(allowed, math.ceil(allowed[short] * _GROWTH))
            at = min(max(grown, short + 1), enough - 1)
    reached = enough < len(allowed)
    best = results[allowed[enough]] if reached else max(results.values(), key=lambda one: one.rank)
    return Reach(
        replace(best, outcome=outcome),
        reached,
        {n: (r.exact, suffices(r)) for n, r in sorted(results.items())},
    )


def allowed_totals(scene: CoreScene, rings: int | None = None) -> Sequence[int]:
    """Return the sensor totals that the rules allow, ascending, up to ``_MOST``.

    Raises:
        InfeasibleError: if they allow none.
    """
    held, least = sum(ring.count for ring in scene.rules.fixed), scene.rules.sensors[0]
    new = 0 if rings is None else max(rings - len(scene.rules.fixed), 0)
    totals = Space(scene, sensors=held + new * least, rings=rings).totals
    if not totals:
        Space(scene, sensors=held + least)  # raises with the reason
    return [n for n in totals if n <= _MOST] or totals[:1]


def fewest_rings(
    scene: CoreScene,
    sensors: int,
    within: float = WITHIN,
    seed: int = 0,
    time_cap: float = math.inf,
    schedule: Schedule | None = None,
    voxel: float = 0.01,
    tell: Callable[[int | None, Progress], None] = lambda rings, progress: None,
    known: Sequence[Setup] = (),
    aim: Criterion | None = None,
    verifier: Verifier | None = None,
    device: Device = "auto",
) -> FewestRings:
    """Find the setup with the fewest rings whose exact value is within a margin of the best.

    A first search chooses the number of rings. Bisection between that number and the fewest that
    hold the sensors follows, by searches that start from the results with more rings, until one
    ring fewer than the answer falls short of the margin. Where a limit cut that search short, it
    is repeated if more time is left than it had. They share sample points and occluders.
    This does not prove that fewer rings are impossible: searches find good setups, not bounds.

    Args:
        scene: robot, poses, goals, rules; its fixed rings count too.
        sensors: number of sensors of every setup.
        within: the margin, in [0, 1).
        seed: random seed of all searches.
        time_cap: limit in seconds from the call; then the best answer so far is returned. The
            first search takes half of it at most; the steps that bisection still needs share the
            rest.
        schedule: schedule of the first search; by default the usual one. The others have half as
            many candidates.
        voxel: side of the voxels of the count, m.
        tell: receives the number of rings (None where the search chooses it) and the progress of
            its search.
        known: setups from which the first search starts besides its own.
        aim: the criterion; by default ζ itself.
        verifier: counts the results; by default a new one of ``voxel``.
        device: as in ``search``.

    Raises:
        InfeasibleError: if the rules allow no setup of these sensors.
        ValueError: if ``within`` is not in [0, 1), or a target is empty.
    """
    if not 0 <= within < 1:
        raise ValueError(f"within must be at least 0 and below 1, got {within}")
    began, aim = time.monotonic(), aim or Criterion()
    verifier, space = verifier or Verifier(scene, voxel), Space(scene, sensors=sensors)
    rounds = usual(scene, space, aim) if schedule is None else schedule
    points = Fields.drawn(space, aim, judging_points(rounds), seed)

    def searched(
        space: Space, rings: int | None, steps: float, rounds: Schedule, known: Sequence[Setup]
    ) -> SearchResult:
        cap = max(time_cap - (time.monotonic() - began), 0.0) / steps
        return search(
            *(scene, space, seed, cap, rounds, voxel, lambda progress: tell(rings, progress)),
            *(known, aim, verifier),
            points=points,
            device=device,
        )

    first = searched(space, None, 1 / _FIRST, rounds, known)
    outcome, fewer = first.outcome, tuple(replace(r, keep=max(r.keep // 2, 2)) for r in rounds)
    too_few = max(math.ceil(space.free / max(space.most, 1)) + len(space.fixed) - 1, 0)
    so_far = FewestRings(first, within, {len(first.setup.rings): first}, too_few)
    while outcome is not Outcome.INTERRUPTED:
        left = time_cap - (time.monotonic() - began)
        between = so_far.untried or so_far.doubtful(left)
        if not between:
            break
        if left <= 0:
            outcome = Outcome.TIME
            break
        rings, steps = between[len(between) // 2], len(between).bit_length()
        more = [one.setup for n, one in so_far.tried.items() if n >= rings]
        try:
            stated = Space(scene, sensors=sensors, rings=rings)
            result = searched(stated, rings, steps, fewer, more[:_STARTS])
        except InfeasibleError:  # too few rings for the sensors, or rings that collide
            so_far = replace(so_far, too_few=rings)
            continue
        except KeyboardInterrupt:  # before the search had anything to return
            outcome = Outcome.INTERRUPTED
            break
        outcome = outcome if result.outcome is Outcome.FINISHED else result.outcome
        so_far = replace(so_far, tried=dict(sorted({**so_far.tried, rings: result}.items())))
    return replace(so_far, result=replace(so_far.tried[so_far.fewest], outcome=outcome))
