"""The search for the best setup in a scene."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any, get_args

from ._arguments import number, renamed, whole
from ._errors import InputError, input_errors
from ._proposal import Proposal
from ._rings import Rings
from ._robustness import mounting_errors
from ._scene import Scene, core_scene
from ._validation import check_scene, check_search_sight
from .coverage.choices import Losing
from .coverage.rings.mounting_errors import MountingErrors
from .coverage.rings.ring import Setup
from .objectives.criterion import Criterion, check_criterion
from .objectives.scene import CoreScene
from .objectives.verify import VOXEL, Verifier
from .placement.bound.coverage_bound import CoverageBound
from .placement.search import search as searching
from .placement.search.gradient_stage import Device, accelerated
from .placement.search.progress import Progress
from .placement.search.result import FewestRings, Reach, SearchResult
from .placement.search.several_searches import (
    allowed_totals,
    fewest_rings,
    fewest_sensors,
    repeated_search,
)
from .placement.space.design import Space
from .placement.space.feasible_set import InfeasibleError

__all__ = ["InfeasibleError", "search"]

_MOST_COVERING = 10  # redundancy; the time of a search grows with it
_MOST_SEARCHES = 1000


def cap_of(time: float | None) -> float:
    """Return the limit of a search in seconds, infinite for None.

    Raises:
        InputError: if it is not a positive number.
    """
    if time is not None and not 0 < time < math.inf:
        raise InputError(f"found {time:g}, allowed: a positive number of seconds", "time")
    return math.inf if time is None else time


def criterion(
    scene: CoreScene, redundancy: int, losing: Losing | None, errors: MountingErrors | None
) -> Criterion:
    """Return what a search maximises.

    Args:
        scene: scene of the search.
        redundancy: number of sensors that must cover a point.
        losing: unit whose worst loss the coverage must survive.
        errors: distribution of mounting errors, or None.

    Raises:
        InputError: for criteria that cannot be combined.
    """
    tolerant = errors is not None
    whole("redundancy", redundancy, 1, _MOST_COVERING)
    if losing is not None and losing not in get_args(Losing):
        raise InputError(f"found {losing!r}, allowed: {', '.join(get_args(Losing))}", "losing")
    if losing is not None and (tolerant or redundancy > 1):
        raise InputError(
            f"found {losing}, allowed: only without redundancy and tolerant",
            "losing",
            others=("redundancy", "tolerant"),
        )
    if scene.over_poses == "worst" and (losing is not None or tolerant or redundancy > 1):
        raise InputError(
            "found worst, allowed: only without redundancy, losing and tolerant",
            "over_poses",
            others=("redundancy", "losing", "tolerant"),
        )
    with input_errors("losing"):
        check_criterion(scene, Criterion(losing=losing))
    return Criterion(redundancy, errors, losing=losing)


@renamed(time_cap="time", reach_percent="reach", within_points="within")
def search(
    scene: Scene | CoreScene | None = None,
    *,
    sensors: int | None = None,
    rings_per_link: int | None = None,
    sensors_per_ring: int | None = None,
    rings: int | None = None,
    any_rings: bool = False,
    fewest_rings: bool = False,
    within: float | None = None,
    reach: float | None = None,
    redundancy: int = 1,
    losing: Losing | None = None,
    tolerant: bool = False,
    position_error_mm: float = 5.0,
    direction_error_deg: float = 2.0,
    seed: int = 0,
    searches: int = 1,
    time: float | None = None,
    voxel: float = VOXEL,
    start: Sequence[Setup] = (),
    gap: bool = False,
    device: Device = "auto",
    progress: Callable[[Progress], None] | None = None,
) -> Proposal:
    """Search for the setup with the highest coverage of a scene's targets, and count it.

    The same seed gives the same answer on the same machine. Ctrl-C ends the search and returns the
    best setup so far; ``outcome`` then is ``Outcome.INTERRUPTED``.

    Args:
        scene: scene of the search; by default the reference scene.
        sensors: number of sensors, in the fewest rings whose coverage is near the best;
            ``rings_tried`` of the result has the coverage of each number of rings. The default is a
            fixed layout: two rings of 16 sensors on each link with a length, and one on the tool.
        rings_per_link: rings on each link of the fixed layout.
        sensors_per_ring: sensors on each ring, of the fixed layout or with ``rings``.
        rings: number of rings, on links that the search chooses. With ``sensors`` the search also
            divides these among the rings; otherwise all rings have ``sensors_per_ring``, by default
            16 or as many as fit.
        any_rings: place ``sensors`` for the highest coverage, in as many rings as that takes. It
            needs about half the time.
        fewest_rings: what ``sensors`` alone does, stated.
        within: with ``sensors``, the largest loss of coverage that fewer rings may cost,
            percentage points; by default 1.
        reach: find the fewest sensors with this coverage, percent.
        redundancy: maximise the share that at least this number of sensors covers, 1 to 10.
        losing: maximise the share that stays covered after the worst loss of one ``ring`` or one
            ``sensor``.
        tolerant: maximise the mean share under mounting errors.
        position_error_mm: limit of these errors along a link, mm, as in ``robustness``.
        direction_error_deg: limit of these errors of direction, degrees, as in ``robustness``.
        seed: random seed of starts and points.
        searches: number of searches, with the seeds ``seed``, ``seed + 1``, ...; the best answer
            counts, ``seed`` of the result is its seed, and ``searched`` has the value of each. With
            ``sensors`` only beside ``rings`` or ``any_rings``; not with ``reach``.
        time: limit in seconds, for all searches together; by default a search ends by its own
            schedule.
        voxel: side of the voxels of the count, m.
        start: setups to start from, in addition to random ones.
        gap: also compute an upper bound on every layout of the same budget; ``gap`` and ``bound``
            of the result have it. It takes about a minute for each target at each pose, at most
            four of them. It is refused where no bound is known: with ``tolerant``, obstacles,
            attached solids, weight fields and volumes of your own.
        device: ``auto`` uses an accelerator where JAX finds one, ``gpu`` demands it, ``cpu`` does
            without. On an accelerator gradients lead the global stage of a single search, with many
            candidates at once.
        progress: receives the progress from time to time, in the calling thread; the first call
            comes before any points are drawn.

    Returns:
        The best setup with its counted coverage.

    Raises:
        InfeasibleError: if the rules admit no setup.
        InputError: for arguments that are out of range or cannot be combined.

    Example:
        >>> import place_rings as pr
        >>> result = pr.search(sensors=8, time=1, voxel=0.05)
        >>> result.setup.sensors
        8
    """
    core = core_scene(CoreScene() if scene is None else scene)
    if time is not None:
        number("time", time, "a positive number of seconds")
    cap = cap_of(time)
    whole("seed", seed, 0)
    whole("searches", searches, 1, _MOST_SEARCHES)
    known = _starts(start)
    choice = Rings(
        sensors,
        rings_per_link,
        sensors_per_ring,
        reach,
        rings,
        fewest_rings,
        within,
        any_rings,
    )
    choice.check()
    errors = mounting_errors(position_error_mm, direction_error_deg) if tolerant else None
    aim = criterion(core, redundancy, losing, errors)
    space = choice.space(core)
    if searches > 1 and space is None:
        raise InputError(
            f"found {searches}, allowed: 1 with reach, and with sensors without any_rings or rings",
            "searches",
            others=("reach", "sensors", "any_rings", "rings"),
        )
    if gap:
        _check_gap(core, aim)
    check_scene(core, voxel)
    check_search_sight(core)
    with input_errors("device"):
        accelerated(device)
    if choice.fewest:
        Space(core, sensors=sensors)  # raises before anything is told of the search
    elif space is None:
        allowed_totals(core, choice.rings)  # likewise
    verifier, tell = Verifier(core, voxel), progress or (lambda _: None)
    tell(Progress())
    reached = fewest = repeated = None
    with input_errors(but=(InfeasibleError,)):
        if space is not None:
            wanted = space

            def run(seed: int, cap: float, tell: Callable[[Progress], None]) -> SearchResult:
                return searching.search(
                    core,
                    wanted,
                    seed,
                    cap,
                    tell=tell,
                    known=known,
                    aim=aim,
                    verifier=verifier,
                    device=device,
                )

            repeated = repeated_search(run, searches, seed, cap, tell)
            result, seed = repeated.result, repeated.seed
        elif choice.fewest:
            fewest = _fewest_rings(core, choice, seed, cap, tell, known, aim, verifier, device)
            result = fewest.result
        else:
            reached = _fewest_sensors(core, choice, seed, cap, voxel, tell, aim)
            result = reached.result
    bound = _bound(core, choice, space, result.setup, aim) if gap else None
    return Proposal(
        result.setup,
        Scene.of(core),
        search=result,
        criterion=aim,
        seed=seed,
        reach=reached,
        wanted_percent=reach,
        bound=bound,
        fewest=fewest,
        repeated=repeated if searches > 1 else None,
        command=f"place_rings.search(..., seed={seed})",
        gapped=gap,
        verifier=verifier,
    )


def _check_gap(scene: CoreScene, aim: Criterion) -> None:
    """Check that an upper bound is known for a search, before it begins.

    Raises:
        InputError: otherwise.
    """
    from .placement.bound.upper_bound import unboundable

    if (reason := unboundable(scene, aim)) is not None:
        raise InputError(
            f"found a search with {reason}, for which no upper bound is known; allowed: named"
            " targets without weights, and a scene without obstacles, attached solids and mounting"
            " errors",
            "gap",
        )


def _bound(
    scene: CoreScene, choice: Rings, space: Space | None, setup: Setup, aim: Criterion
) -> CoverageBound | None:
    """Return an upper bound on all layouts with the budget of a search's answer; None after
    Ctrl-C."""
    from .placement.bound.upper_bound import upper_bound

    if space is None:
        sensors = sum(ring.count for ring in setup.rings)
        space = Space(scene, sensors=sensors, rings=choice.rings)
    try:
        return upper_bound(scene, space, aim)
    except KeyboardInterrupt:
        return None


def _starts(start: Any) -> tuple[Setup, ...]:
    """Return the setups to start from; raise InputError for anything else."""
    each = tuple(start) if isinstance(start, Iterable) else (start,)
    for one in each:
        if not isinstance(one, Setup):
            raise InputError(f"found {one!r}, allowed: a list of Setups", "start")
    return each


def _fewest_sensors(
    scene: CoreScene,
    choice: Rings,
    seed: int,
    cap: float,
    voxel: float,
    tell: Callable[[Progress], None],
    aim: Criterion,
) -> Reach:
    def of_one(count: int, progress: Progress) -> None:
        tell(replace(progress, sensors=count))

    wanted = (choice.reach or 0.0) / 100
    return fewest_sensors(
        scene, wanted, seed, cap, voxel=voxel, tell=of_one, aim=aim, rings=choice.rings
    )


def _fewest_rings(
    scene: CoreScene,
    choice: Rings,
    seed: int,
    cap: float,
    tell: Callable[[Progress], None],
    known: Sequence[Setup],
    aim: Criterion,
    verifier: Verifier,
    device: Device,
) -> FewestRings:
    def of_one(count: int | None, progress: Progress) -> None:
        tell(replace(progress, rings=count))

    return fewest_rings(
        scene,
        choice.sensors or 0,
        choice.within,
        seed,
        cap,
        tell=of_one,
        known=known,
        aim=aim,
        verifier=verifier,
        device=device,
    )
