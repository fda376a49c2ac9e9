"""The pool of candidates of a search: known starts and results of the exchange."""

import math
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ...objectives.criterion import Criterion
from ...objectives.scene import CoreScene
from .design import Candidate, Space
from .exchange import share_of
from .exchange_rounds import exchange
from .feasible_record import FeasibleRecord
from .progress import Progress
from .schedule import Schedule
from .search_points import SearchPoints
from .stop_token import StopToken

_PAUSE = 0.5  # s, after which the best candidate of a round is judged on all points before its end


class Pool:
    """The candidates of a search, the best first."""

    def __init__(
        self,
        scene: CoreScene,
        space: Space,
        aim: Criterion,
        schedule: Schedule,
        seed: int,
        brake: StopToken,
        threads: ThreadPoolExecutor,
        tell: Callable[[Progress], None],
        known: list[Candidate],
        points: SearchPoints | None = None,
    ) -> None:
        """Draw the points, unless ``points`` are given, and start with the candidates ``known``.

        Raises:
            ValueError: for an empty target, or floors of goals that the criterion does not support.
        """
        self.scene, self.space, self.schedule, self.seed = scene, space, schedule, seed
        self.brake, self.threads, self.tell, self.some = brake, threads, tell, known
        self.aim = aim
        points = points or SearchPoints(scene, space, aim, schedule, seed)
        self.fields, self.points = points.fields, points.points
        self.rng, self.luck = (np.random.default_rng((seed, i)) for i in (1, 2))
        self.progress = Progress(stages=len(schedule))
        self.record = FeasibleRecord(space, self.fields, seed) if space.clear else None
        self.starts = max(schedule[0].keep, len(known))
        self.ready = time.monotonic()  # when points and occluders were there
        self._shown = self._best = -math.inf

    def share(self, c: Candidate) -> float | None:
        """Return the criterion of a candidate on all points; None where a stop came first."""
        try:
            return share_of(self.space, self.fields, c)
        except KeyboardInterrupt:
            self.brake.pulled.set()
            return None

    def exchange(self) -> None:
        """Run the rounds of the exchange.

        The result replaces the pool.
        """

        def tell(number: int, over: float, done: bool, c: Candidate) -> None:
            progress = self.progress
            progress.stage, progress.done, progress.climbs = number + 1, round(100 * over), 100
            if done or self.brake.on() or time.monotonic() - self._shown > _PAUSE:
                self._show(c)
            self.tell(progress)

        self.progress.stage = 1
        self.tell(self.progress)
        if self.record is not None:
            self.record.begin(self.some)
        self.some = exchange(
            *(self.space, self.fields, self.seed, self.brake, self.threads),
            *(tell, self.some, self.schedule),
            *([self.record.look] if self.record else []),
        )

    def _show(self, c: Candidate) -> None:
        """Keep a candidate as the best so far if its value on all points is higher; where rings
        may collide, the best of the record."""
        if self.record is None:
            share = share_of(self.space, self.fields, c)
        elif self.record.best is None:
            return
        else:
            share, c = self.record.share, self.record.best
        self._shown = time.monotonic()
        if share > self._best:
            self._best, self.progress.setup = share, self.space.setup(c)
            self.progress.best = max(share, 0.0)  # a missed floor lowers it, even below 0
