"""The search for the best setup in a scene."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from math import radians

from ._arguments import check_question, renamed
from ._errors import InputError, input_errors
from ._options import called_with
from ._proposal import Proposal
from ._validation import check_scene, check_search_sight, given_scene
from ._versions import origin
from .coverage.rings.mounting_errors import MountingErrors
from .objectives.criterion import Criterion, check_criterion, check_detection
from .objectives.scene import Scene
from .objectives.verify import Verifier
from .placement.bound.coverage_bound import CoverageBound
from .placement.search import search as searching
from .placement.search.context import SearchContext
from .placement.search.gradient_stage import accelerated
from .placement.search.options import SearchOptions
from .placement.search.progress import Progress
from .placement.search.result import Reach
from .placement.search.several_searches import (
    fewest_rings,
    fewest_sensors,
    repeated_search,
    space_of,
)
from .placement.space.design import Space
from .placement.space.feasible_set import InfeasibleError

__all__ = ["InfeasibleError", "search"]


def criterion(scene: Scene, options: SearchOptions) -> Criterion:
    """Return what a search maximises in a scene.

    Raises:
        InputError: for criteria that cannot be combined.
    """
    redundancy, losing, errors = options.redundancy, options.losing, None
    check_question(options.detect)
    if (detection := options.detect) is not None:
        at_least = max(redundancy, detection.at_least)
        redundancy, detection = 1, replace(detection, at_least=at_least)
        with input_errors("detect"):
            check_detection(scene, detection)
    if options.tolerant:
        mm, angle = options.position_error_mm, options.direction_error_deg
        position, direction = 5.0 if mm is None else mm, 2.0 if angle is None else angle
        errors = MountingErrors(position / 1000, radians(direction))
    aim = Criterion(redundancy, errors, losing=losing, detection=detection)
    if scene.over_poses == "worst" and not aim.plain:
        raise InputError(
            "found worst, allowed: only without redundancy, losing, tolerant and detect",
            "over_poses",
            others=("redundancy", "losing", "tolerant", "detect"),
        )
    with input_errors("losing"):
        check_criterion(scene, Criterion(losing=losing))
    return aim


@dataclass(frozen=True)
class SearchCall(SearchOptions):
    """A call of ``search``."""

    scene: Scene | None = field(default=None, kw_only=False)
    """Scene of the search; by default the reference scene."""
    progress: Callable[[Progress], None] | None = field(default=None, kw_only=True)
    """Receives the progress from time to time, in the calling thread; the first call comes before
    any points are drawn."""


@renamed(time_cap="time", reach_percent="reach", within_points="within")
@called_with(SearchCall)
def search(call: SearchCall) -> Proposal:
    """Search for the setup with the highest coverage of a scene's targets, and count it.

    The same seed gives the same answer on the same machine. Ctrl-C ends the search and returns the
    best setup so far; ``outcome`` then is ``Outcome.INTERRUPTED``.

    Returns:
        The best setup with its counted coverage. With ``sensors`` alone ``rings_tried`` has the
        coverage of each number of rings; with ``searches``, ``seed`` is that of the best and
        ``searched`` has the value of each; with ``gap``, ``gap`` and ``bound`` have the bound.

    Raises:
        InfeasibleError: if the rules admit no setup.
        InputError: for arguments that are out of range or cannot be combined.

    Example:
        >>> import place_rings as pr
        >>> result = pr.search(sensors=8, time=1, voxel=0.05)
        >>> result.setup.sensors
        8
    """
    scene = given_scene(call.scene)
    tell = call.progress or (lambda progress: None)
    aim = criterion(scene, call)
    with input_errors(but=(InfeasibleError,)):
        space = space_of(call, scene)
    if call.gap:
        _check_gap(scene, call, space, aim)
    seeing = space.sensors + sum(group.count for group in scene.standing)
    if aim.detection is not None and aim.detection.at_least > seeing and call.reach is None:
        raise InputError(
            f"found detection by {aim.detection.at_least} sensors, allowed: at most {seeing}, those"
            " of the search",
            "detect",
        )
    check_scene(scene, call.voxel)
    check_search_sight(scene)
    with input_errors("device"):
        accelerated(call.device)
    tell(Progress())
    verifier = Verifier(scene, call.voxel)
    context = SearchContext(verifier, aim, tell)
    reached = fewest = repeated = None
    with input_errors(but=(InfeasibleError,)):
        if call.reach is not None:
            reached = fewest_sensors(call, context)
            result = reached.result
        elif call.fewest:
            fewest = fewest_rings(space, call, context)
            result = fewest.result
        else:
            repeated = repeated_search(partial(searching.search, space), call, context)
            result = repeated.result
    bound = _bound(scene, space, aim, call, reached) if call.gap else None
    if bound is not None and bound.value is not None:
        bound = replace(bound, gap=bound.value - result.exact)
    found = replace(
        result,
        bound=bound.value if bound is not None and bound.informative else None,
        **origin(f"place_rings.search(..., seed={result.seed})"),
    )
    return Proposal(
        result.setup,
        scene,
        found=found,
        criterion=aim,
        reach=reached,
        bound=bound,
        fewest=fewest,
        repeated=repeated if call.searches > 1 else None,
        verifier=verifier,
    )


def _check_gap(scene: Scene, options: SearchOptions, space: Space, aim: Criterion) -> None:
    """Refuse a gap where no bound is known, or where it would say nothing.

    Raises:
        InputError: if that is so.
    """
    from .placement.bound.forecast import says_nothing  # loads SciPy
    from .placement.bound.upper_bound import unboundable

    if (reason := unboundable(aim)) is not None:
        line = f"found a search with {reason}, for which no upper bound is known; allowed: without"
        raise InputError(line, "gap")
    wanted = 1.0 if options.reach is None else options.reach / 100
    with input_errors("targets"):
        nothing = says_nothing(scene, space, aim, wanted)
    if nothing and options.reach is not None:
        raise InputError(
            f"found with reach {options.reach:g}, for which the bound says nothing: as far as it"
            f" knows, {space.sensors} sensors, the fewest that the rules allow, may reach it;"
            " allowed: a larger reach",
            "gap",
            others=("reach",),
        )
    if nothing:
        raise InputError(
            f"found with {space.sensors} sensors, for which the upper bound says nothing: it would"
            " be 100 %, as their beams could cover all of the target if they never had to overlap;"
            " allowed: fewer sensors, or a larger target",
            "gap",
        )


def _bound(
    scene: Scene, space: Space, aim: Criterion, options: SearchOptions, reached: Reach | None
) -> CoverageBound:
    """Return an upper bound on all layouts with the budget of a search's answer, without a value
    after Ctrl-C."""
    from .placement.bound.upper_bound import upper_bound

    if reached is not None:
        sensors = sum(ring.count for ring in reached.result.setup.rings)
        space = Space(scene, sensors=sensors, rings=options.rings)
    try:
        reach = None if reached is None else reached.wanted
        bound = upper_bound(scene, space, aim, reach=reach)
    except KeyboardInterrupt:
        return CoverageBound()
    bound = bound or CoverageBound()
    if reached is not None and reached.reached and bound.fewest_sensors is not None:
        # voxels may count a little more than the exact coverage
        bound = replace(bound, fewest_sensors=min(bound.fewest_sensors, sensors))
    return bound
