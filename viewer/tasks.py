"""Long tasks of a page: a count with a guaranteed interval, and a search from the
current setup.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from ..coverage.rings.ring import Setup
from ..coverage.rings.rounding import rounded
from ..coverage.targets.target import Target
from ..coverage.voxels.volume_tally import Bracket
from ..objectives.criterion import Criterion, judge
from ..objectives.feasibility.violations import held
from ..objectives.pose_subset import MANY
from ..objectives.scene import Scene
from ..objectives.smallest_object import gap_excess
from ..objectives.verified import Verified
from ..objectives.verify import VOXEL, Verifier
from ..placement.search.context import SearchContext
from ..placement.search.options import SearchOptions
from ..placement.search.progress import Progress
from ..placement.search.schedule import Schedule
from ..placement.search.search import search
from ..placement.space.design import Space
from ..placement.stop_token import StopToken

WIDTH = 0.001  # width of the guaranteed interval, as a share
# receives the current step and the completed share in [0, 1]; may raise
Tell = Callable[[str, float], None]
_LONG = 1e9  # s
_STOPPED = "stopped: the best result so far"


@dataclass(frozen=True)
class Proof:
    """ζ of one target, counted by voxels and as a guaranteed interval."""

    counted: Verified
    """Count by voxels."""
    certified: Verified
    """Interval that is guaranteed to hold ζ."""


def prove(
    scene: Scene,
    setup: Setup,
    targets: tuple[Target, ...],
    tell: Tell,
    voxel: float = VOXEL,
    width: float = WIDTH,
) -> tuple[Proof, ...]:
    """Count each target and compute a guaranteed interval.

    Args:
        scene: robot, poses, occlusion.
        setup: setup to count.
        targets: targets to count.
        tell: called often with the progress; an exception from it ends the count.
        voxel: side of a voxel, m.
        width: width of the interval, as a share.

    Raises:
        ValueError: see ``Verifier.verify``.
    """
    total, step = len(targets) * 2 * len(scene.poses), 0

    def at(pose: int) -> None:
        nonlocal step
        tell(f"counting pose {pose + 1} of {len(scene.poses)}", step / total)
        step += 1

    def narrower(b: Bracket) -> None:
        tell(f"{100 * b.low:.2f} … {100 * b.high:.2f} %", (step - 1) / total)

    counting = Verifier(scene, voxel, at=at)
    proving = Verifier(scene, None, "certified", width, narrower, at=at)
    return tuple(
        Proof(counting.verify(setup, target), proving.verify(setup, target)) for target in targets
    )


@dataclass(frozen=True)
class SearchAnswer:
    """Result of a search."""

    setup: Setup
    """The better setup, or the initial one."""
    before: float
    """ζ of the goals in [0, 1] before the search."""
    after: float
    """ζ of the goals in [0, 1] after the search."""
    better: bool
    """True if the search improved ζ."""
    outcome: str
    """How the search ended."""


def search_from(
    scene: Scene,
    setup: Setup,
    tell: Tell,
    stopped: Callable[[], bool],
    target: Target | None = None,
    free: bool = False,
    seed: int = 0,
    schedule: Schedule | None = None,
    voxel: float = VOXEL,
) -> SearchAnswer:
    """Search from ``setup``; the result is better by the count, or ``setup`` itself.

    Args:
        scene: robot, poses, goals, rules.
        setup: starting point of the search.
        tell: receives the progress.
        stopped: returns True to end the search with the best result so far.
        target: target that replaces the scene's goals, or None; what the scene demands of it stays.
        free: True to choose rings and counts freely with the same number of sensors; False to keep
            links and counts.
        seed: random seed of the search.
        schedule: schedule of the search, or None for the default.
        voxel: side of a voxel of the count, m.

    Raises:
        InfeasibleError: if the scene's rules leave no place for such rings.
        ValueError: for an empty target or a setup without rings.
    """
    asked = scene
    if target is not None:
        stated = tuple(goal for goal in scene.targets if goal.target == target)
        asked = replace(scene, targets=stated or (target,), over_poses="mean")
    present = rounded(setup, scene.sensor)
    if not present.rings:
        raise ValueError("the setup has no ring to search from; add one")
    fixed, _ = held(scene, present.rings)
    layout = Setup(tuple(ring for i, ring in enumerate(present.rings) if i not in fixed))
    # the single sensors stay, as those of the scene do
    asked = replace(asked, rules=replace(asked.rules, fixed_sensors=present.singles))
    on_rings = present.sensors - len(present.singles)
    space = Space(asked, sensors=on_rings) if free else Space(asked, layout)
    verifier, aim = Verifier(asked, voxel), Criterion()
    tell("counting the initial setup", 0.0)
    short, before = judge(verifier, present, aim)
    short += gap_excess(asked, present)
    if stopped():
        return SearchAnswer(present, before, before, False, _STOPPED)

    def progress(p: Progress) -> None:
        if p.to_count:
            tell("counting the best setup", 0.95)
        else:
            tell(
                f"about {100 * p.best:.1f} %, stage {p.stage} of {p.stages}",
                0.95 * p.climbed / max(p.stages, 1),
            )

    def clock() -> float:
        return math.inf if stopped() else time.monotonic()

    context = SearchContext(verifier, aim, progress, StopToken(_LONG, clock), schedule)
    result = search(space, SearchOptions(seed=seed, start=(present,)), context)
    lacks, after = result.missed, result.exact
    if len(asked.poses) > MANY:  # the search may have used a coarse count
        lacks, after = judge(verifier, result.setup, aim)
    better = (lacks, -after) < (short, -before)
    ended = _STOPPED if stopped() else "the search completed"
    return SearchAnswer(
        result.setup if better else present, before, after if better else before, better, ended
    )
