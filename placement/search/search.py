"""The search: exchange ring by ring, then climbs on the soft zeta while it sharpens, from what came
furthest and, where the exchange does not see all that counts, from unlike starts and variants; the
exact count chooses at the end.

The sigmoid is narrow from the start. A wide one counts what lies between many cones as seen, and so
prefers other setups than the exact count does: at 0.1 m climbs leave the best ones of a far shell.
"""

import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from ...coverage.processors import processors
from ...coverage.rings.ring import Setup
from ...coverage.rings.rounding import rounded
from ...objectives.criterion import Criterion
from ...objectives.scene import Scene
from ...objectives.verify import Verified, Verifier
from .collision_repair import apart
from .design import Space
from .finalists import choose
from .local_search import StopToken
from .moves import fitted, fresh, papers
from .multistart import Pool
from .progress import Outcome, Progress, Statistics
from .schedule import FINALISTS, Schedule, usual


@dataclass(frozen=True)
class SearchResult:
    """The setup, soft and exact value of its aim (weighted means in [0, 1]; over the poses the mean
    or the worst, as the scene asks), by how much the exact ones fall short of the goals' floors,
    how the search ended and what it spent; the side of the voxels counted, m; and, where there are
    many poses, zeta goal by goal. Where Ctrl-C came before that, the exact value is a rough one, of
    coarser voxels and some of the poses."""

    setup: Setup
    soft: float
    exact: float
    short: float
    outcome: Outcome
    statistics: Statistics
    voxel: float = 0.01
    verified: tuple[Verified, ...] = ()


def search(
    scene: Scene,
    space: Space,
    seed: int = 0,
    time_cap: float = float("inf"),
    schedule: Schedule | None = None,
    voxel: float = 0.01,
    tell: Callable[[Progress], None] = lambda progress: None,
    known: Sequence[Setup] = (),
    aim: Criterion | None = None,
    verifier: Verifier | None = None,
    clock: Callable[[], float] = time.monotonic,
) -> SearchResult:
    """Find the setup of ``space`` that covers most of the scene's goals: positions, tilts and
    phases of its rings, and which rings there are where that is free.

    The same seed gives the same answer on the same machine: the search ends by its schedule.
    ``time_cap`` seconds or a KeyboardInterrupt only cut it short, and then the best so far is
    returned. The paper's tilts are among the starts and the best of all starts among the finalists,
    so the answer is never worse than those. Of many poses, each stage looks at few that stand for
    all, more as it sharpens; where the worst pose counts, half of them are the worst so far.

    Args:
        scene: robot, poses, goals, limits.
        space: the setups to choose from.
        seed: of the starts and of the points.
        time_cap: seconds of the ``clock``, from the call on.
        schedule: starts and stages.
        voxel: side of the voxels of the exact count, m.
        tell: is given the progress from time to time, in this thread.
        known: setups to start from beside the drawn ones, fitted to the space.
        aim: what is made large; by default zeta itself.
        verifier: counts the answer, and keeps the targets for who counts more; by default a new one
            of ``voxel``. clock: by default that on the wall.

    Raises:
        InfeasibleError: where rings of different links meet wherever they were tried.
        ValueError: for an empty target, or floors of goals that the aim cannot keep.
    """
    began, aim = time.monotonic(), aim or Criterion()
    schedule = schedule or usual(scene, space, aim)
    brake = StopToken(clock() + time_cap, clock=clock)
    starts = [
        *papers(space),
        *(c for c in (fitted(space, setup) for setup in known) if c is not None),
    ]
    with ThreadPoolExecutor(processors()) as threads:
        pool = Pool(scene, space, aim, schedule, seed, brake, threads, tell, starts)
        try:
            pool.exchange()
            pool.climb()
        except KeyboardInterrupt:
            brake.pulled.set()
    progress, late = pool.progress, brake.on()
    finalists = apart(
        space, [*pool.first, *pool.some[:FINALISTS]] or [fresh(space, pool.rng)], pool.luck
    )
    setups = [rounded(space.setup(c), scene.sensor) for c in finalists]

    def counting(counted: int, to_count: int) -> None:
        progress.counted, progress.to_count = counted, to_count
        tell(progress)

    counted = choose(verifier or Verifier(scene, voxel), setups, aim, brake, pool.luck, counting)
    soft = pool.soft(finalists[counted.index])
    outcome = (
        Outcome.INTERRUPTED if brake.pulled.is_set() else Outcome.TIME if late else Outcome.FINISHED
    )
    spent = Statistics(schedule.starts, pool.evaluations, time.monotonic() - began, pool.width)
    return SearchResult(
        setups[counted.index],
        soft,
        counted.exact,
        counted.short,
        outcome,
        spent,
        counted.voxel,
        counted.verified,
    )
