"""The long work that a page asks for: an exact count with a guaranteed interval, and a search from
the present setup.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from ..coverage.occlusion.model import Occlusion
from ..coverage.rings.ring import Setup
from ..coverage.rings.rounding import rounded
from ..coverage.targets import Target
from ..coverage.voxels.certified_bounds import Bracket
from ..objectives.criterion import Criterion, judge
from ..objectives.feasibility.violations import held
from ..objectives.pose_subset import MANY
from ..objectives.scene import Goal, Scene
from ..objectives.verify import VOXEL, Verified, Verifier
from ..placement.search.design import Space
from ..placement.search.progress import Progress
from ..placement.search.schedule import Schedule
from ..placement.search.search import search

WIDTH = 0.001  # of the guaranteed interval, a share
# is given what is being done, and how much of all is over, in [0, 1]; may raise
Tell = Callable[[str, float], None]
_LONG = 1e9  # s
_STOPPED = "stopped: the best until then"


@dataclass(frozen=True)
class Proof:
    """ζ of one target: counted voxel by voxel, and an interval that is guaranteed to hold it."""

    counted: Verified
    certified: Verified


def prove(
    scene: Scene,
    setup: Setup,
    targets: tuple[Target, ...],
    tell: Tell,
    voxel: float = VOXEL,
    width: float = WIDTH,
) -> tuple[Proof, ...]:
    """Count each target and prove an interval as wide as ``width``. ``tell`` is called often: what
    it raises ends the count.

    Raises:
        ValueError: as ``Verifier.verify`` does.
    """
    total, step = len(targets) * 2 * len(scene.poses), 0

    def at(pose: int) -> None:
        nonlocal step
        tell(f"counting pose {pose + 1} of {len(scene.poses)}", step / total)
        step += 1

    def narrower(b: Bracket) -> None:
        tell(f"{100 * b.low:.2f} … {100 * b.high:.2f} %", (step - 1) / total)

    counting = Verifier(scene, voxel, "centre", at=at)
    proving = Verifier(scene, None, "certified", width, narrower, at=at)
    return tuple(
        Proof(counting.verify(setup, target), proving.verify(setup, target)) for target in targets
    )


@dataclass(frozen=True)
class SearchAnswer:
    """What a search came to: the setup, ζ of what was asked for before and after, in [0, 1],
    whether that is better, and how it ended, in words."""

    setup: Setup
    before: float
    after: float
    better: bool
    outcome: str


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
    """Search from ``setup`` on; what comes back is better by the exact count, or else ``setup``
    itself.

    Args:
        scene: robot, poses, goals, rules.
        setup: where the search starts.
        tell: is given the progress.
        stopped: shall the search end? The best until then is taken.
        target: to be seen in place of the scene's goals.
        free: rings and counts are free, with as many sensors; else links and counts stay.
        seed: of the search.
        schedule: of the search, by default the usual one.
        voxel: side of the voxels of the exact count, m.

    Raises:
        InfeasibleError: where the scene's rules have no place for such rings.
        ValueError: for an empty target.
    """
    asked = scene if target is None else replace(scene, goals=(Goal(target),), over_poses="mean")
    present = rounded(setup, scene.sensor)
    fixed, _ = held(scene, present.rings)
    layout = Setup(tuple(ring for i, ring in enumerate(present.rings) if i not in fixed))
    space = Space(asked, sensors=present.sensors) if free else Space(asked, layout)
    verifier, aim = Verifier(asked, voxel), Criterion()
    tell("counting what is there", 0.0)
    short, before = judge(verifier, present, aim)
    if stopped():
        return SearchAnswer(present, before, before, False, _STOPPED)

    def progress(p: Progress) -> None:
        if p.to_count:
            tell("counting the best", 0.95)
        else:
            tell(
                f"about {100 * p.best:.1f} %, stage {p.stage} of {p.stages}",
                0.95 * p.climbed / max(p.stages, 1),
            )

    def clock() -> float:
        return math.inf if stopped() else time.monotonic()

    result = search(
        asked, space, seed, _LONG, schedule, voxel, progress, (present,), aim, verifier, clock
    )
    lacks, after = result.short, result.exact
    if len(asked.poses) > MANY:  # the search may have counted roughly
        lacks, after = judge(verifier, result.setup, aim)
    better = (lacks, -after) < (short, -before)
    ended = _STOPPED if stopped() else "the search ran to its end"
    return SearchAnswer(
        result.setup if better else present, before, after if better else before, better, ended
    )


def seen_under(scene: Scene, occlusion: Occlusion) -> Scene:
    """The scene as a page has it: under the model of occlusion that is chosen there."""
    return scene if occlusion == scene.occlusion else replace(scene, occlusion=occlusion)
