"""Several searches that follow each other: with other random seeds, for the fewest sensors that
reach a coverage, and for the fewest rings near the best coverage."""

import math
import time
from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import replace

from ...coverage.definitions.errors import InputError
from ...coverage.rings.ring import Setup
from ...objectives.mount_rules import Rules
from ...objectives.named_layouts import ring_layout
from ...objectives.scene import Scene
from ..space.design import Space
from ..space.feasible_set import InfeasibleError
from .context import SearchContext
from .exchange_points import Fields
from .options import SearchOptions
from .progress import Outcome, Progress
from .result import FewestRings, Reach, RepeatedSearch, SearchResult, SensorsTried
from .schedule import judging_points, usual
from .search import search

_STARTS = 3  # earlier results from which a search starts
_SENSORS, _GROWTH = 24, 1.6  # sensors of the first search; factor until a number suffices
_MOST = 2000  # sensors
_FIRST = 0.5  # share of the time of the search that chooses the number of rings
_RINGS_PER_LINK, _SENSORS_PER_RING = 2, 16  # by default, the latter where the rules allow it
# runs one search with the options of its seed, and a context with the time that is left
Run = Callable[[SearchOptions, SearchContext], SearchResult]


def space_of(options: SearchOptions, scene: Scene) -> Space:
    """Return the design space of a search, of several the first.

    Raises:
        InfeasibleError: if the scene's rules admit no setup.
        InputError: for a number of sensors that the scene's rules do not allow on a ring.
    """
    if options.reach is not None:
        return Space(scene, sensors=allowed_totals(scene, options.rings)[0], rings=options.rings)
    if options.sensors is not None:
        return Space(scene, sensors=options.sensors, rings=options.rings)
    count = _sensors_per_ring(options, scene)
    if options.rings is not None:
        return Space(scene, rings=options.rings, each=count)
    return Space(scene, ring_layout(scene, options.rings_per_link or _RINGS_PER_LINK, count))


def _sensors_per_ring(options: SearchOptions, scene: Scene) -> int:
    (least, most), count = scene.rules.sensors, options.sensors_per_ring
    if count is None:
        count = min(max(_SENSORS_PER_RING, least), most)
    if not least <= count <= most and (least, most) != Rules().sensors:
        raise InputError(
            f"found {count}, allowed: {least} to {most}, the scene's rules.sensors_per_ring",
            "sensors_per_ring",
        )
    if options.sensors_per_ring is None and options.rings is not None:
        # as many as the boards of all rings allow
        held = sum(ring.count for ring in scene.rules.fixed)
        sizes = Space(scene, sensors=held).largest()
        new = min(max(options.rings - len(scene.rules.fixed), 0), len(sizes))
        count = min([count, *sizes[:new]])
    return count


def repeated_search(run: Run, options: SearchOptions, context: SearchContext) -> RepeatedSearch:
    """Search with as many seeds as the options say, one after the other; keep the best answer.

    The best misses the floors of the goals least, and then has the highest exact value. An answer
    that a stop cut short counts only if it is the only one with voxels as fine. Ctrl-C keeps the
    answers so far. How far the answers lie apart shows what chance decides.

    Args:
        run: runs one search.
        options: seed of the first search, number of searches, and limit of time for all; each
            search may use what is left.
        context: receives the progress.

    Raises:
        InfeasibleError: if no search found a setup that the rules admit.
    """
    began, tried, outcome = time.monotonic(), dict[int, SearchResult](), Outcome.FINISHED
    count = options.searches
    for number in range(1, count + 1):

        def tell(progress: Progress) -> None:
            best = max([progress.best, *(r.exact for r in tried.values())])
            context.tell(replace(progress, best=best))

        left = options.limit if number == 1 else options.limit - (time.monotonic() - began)
        if tried and left <= 0:
            outcome = Outcome.TIME
            break
        seed = options.seed + number - 1
        here = replace(context, tell=tell).within(left, search=number, searches=count)
        try:
            if tried:
                here.tell(Progress())
            tried[seed] = run(replace(options, seed=seed), here)
        except InfeasibleError:  # of this seed: rings collided in every candidate
            if not tried and number == count:
                raise
            continue
        except KeyboardInterrupt:  # before the search had anything to return
            if not tried:
                raise
            outcome = Outcome.INTERRUPTED
            break
        if (outcome := tried[seed].outcome) is not Outcome.FINISHED:
            break
    finest = min(one.voxel for one in tried.values())
    best = max(tried, key=lambda s: (tried[s].voxel == finest, *tried[s].rank))
    return RepeatedSearch(replace(tried[best], outcome=outcome), tried)


def fewest_sensors(options: SearchOptions, context: SearchContext) -> Reach:
    """Find a setup with few sensors whose exact value is at least ``reach``.

    The sensor count grows until a search reaches it, then shrinks by bisection until a search with
    one sensor fewer does not. This does not prove that fewer are impossible: searches find good
    setups, not bounds.

    Args:
        options: the coverage to reach, a weighted mean of ζ over the goals, whose floors hold
            besides; the number of rings, fixed ones included, by default each search chooses it;
            seed of all searches; limit of time from the call, after which the best result so far is
            returned.
        context: what the searches maximise, count with and obey.

    Raises:
        InfeasibleError: if the rules allow no setup at all.
        ValueError: for an empty target.
    """
    wanted, scene, rings = (options.reach or 0.0) / 100, context.scene, options.rings

    def suffices(result: SearchResult) -> bool:
        return result.missed == 0 and result.exact >= wanted

    began, known, outcome = time.monotonic(), list[Setup](), Outcome.FINISHED
    allowed, results = allowed_totals(scene, rings), dict[int, SearchResult]()
    # indices of the largest count that falls short and of the smallest that suffices
    short, enough = -1, len(allowed)
    at = min(bisect_left(allowed, _SENSORS), len(allowed) - 1)
    while enough - short > 1:
        left, sensors = options.limit - (time.monotonic() - began), allowed[at]
        if results and left <= 0:
            outcome = Outcome.TIME
            break
        try:
            space = Space(scene, sensors=sensors, rings=rings)
            here = context.within(left, sensors=sensors)
            result = search(space, replace(options, start=tuple(known)), here)
        except InfeasibleError:  # rings that collide
            if not results:
                raise
            if enough == len(allowed):
                break
            short = at
        else:
            results[sensors], outcome = result, result.outcome
            known = [result.setup, *known][:_STARTS]
            short, enough = (short, at) if suffices(result) else (at, enough)
            if outcome is not Outcome.FINISHED:
                break
        at = (short + enough) // 2
        if enough == len(allowed):
            grown = bisect_left(allowed, math.ceil(allowed[short] * _GROWTH))
            at = min(max(grown, short + 1), enough - 1)
    reached = enough < len(allowed)
    best = results[allowed[enough]] if reached else max(results.values(), key=lambda one: one.rank)
    tried = [SensorsTried(n, r.exact, suffices(r)) for n, r in sorted(results.items())]
    result = replace(best, outcome=outcome)
    return Reach(wanted=wanted, reached=reached, tried=tuple(tried), result=result)


def allowed_totals(scene: Scene, rings: int | None = None) -> Sequence[int]:
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


def fewest_rings(space: Space, options: SearchOptions, context: SearchContext) -> FewestRings:
    """Find the setup with the fewest rings whose exact value is within a margin of the best.

    A first search chooses the number of rings. Bisection between that number and the fewest that
    hold the sensors follows, by searches that start from the results with more rings, until one
    ring fewer than the answer falls short of the margin. Where a limit cut that search short, it
    is repeated if more time is left than it had. They share sample points and occluders.
    This does not prove that fewer rings are impossible: searches find good setups, not bounds.

    Args:
        space: the setups with any number of rings.
        options: number of sensors of every setup; the margin; seed of all searches; setups from
            which the first search starts besides its own; limit of time from the call, after which
            the best answer so far is returned. The first search takes half of it at most; the steps
            that bisection still needs share the rest.
        context: what the searches maximise, count with and obey. Its schedule is that of the first
            search; the others have half as many candidates.

    Raises:
        InfeasibleError: if the rules allow no setup of these sensors.
        ValueError: for an empty target.
    """
    began, scene, aim = time.monotonic(), context.scene, context.aim
    rounds = context.schedule or usual(scene, space, aim)
    points = Fields.drawn(space, aim, judging_points(rounds), options.seed)
    context = replace(context, points=points, schedule=rounds)

    def left() -> float:
        return options.limit - (time.monotonic() - began)

    first = search(space, options, context.within(max(left(), 0.0) * _FIRST))
    fewer = tuple(replace(r, keep=max(r.keep // 2, 2)) for r in rounds)
    context, outcome = replace(context, schedule=fewer), first.outcome
    too_few = max(math.ceil(space.free / max(space.most, 1)) + len(space.fixed) - 1, 0)
    results = {len(first.setup.rings): first}
    so_far = FewestRings(within=options.margin, results=results, too_few=too_few)
    while outcome is not Outcome.INTERRUPTED:
        spare = left()
        between = so_far.untried or so_far.doubtful(spare)
        if not between:
            break
        if spare <= 0:
            outcome = Outcome.TIME
            break
        rings, steps = between[len(between) // 2], len(between).bit_length()
        more = [result.setup for n, result in so_far.results.items() if n >= rings]
        try:
            stated = Space(scene, sensors=options.sensors, rings=rings)
            here = context.within(max(left(), 0.0) / steps, rings=rings)
            result = search(stated, replace(options, start=tuple(more[:_STARTS])), here)
        except InfeasibleError:  # too few rings for the sensors, or rings that collide
            so_far = replace(so_far, too_few=rings)
            continue
        except KeyboardInterrupt:  # before the search had anything to return
            outcome = Outcome.INTERRUPTED
            break
        outcome = outcome if result.outcome is Outcome.FINISHED else result.outcome
        so_far = replace(so_far, results=dict(sorted({**so_far.results, rings: result}.items())))
    return replace(so_far, result=replace(so_far.results[so_far.fewest], outcome=outcome))
