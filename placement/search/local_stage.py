"""The local stage of a search: its best candidates improve by nlopt on the soft coverage."""

from concurrent.futures import Future, ThreadPoolExecutor
from threading import Thread

import numpy as np

from ...objectives.parameterization import decode
from ...objectives.soft_coverage import SoftCoverage
from ..space.design import Candidate, Space
from ..space.starts import fresh
from ..stop_token import StopToken
from .exchange_points import Fields
from .global_stage import SearchRecord
from .local_search import Climb, RingConstraints, climb

_CLIMBED = 2  # best candidates that climb, side by side
_POINTS = 65536  # of all goals and poses together, as far as they were drawn
_FEWEST = 256  # of each goal at each pose
_DECIDED = 0.01  # m, width by which points are chosen that small moves may cover or uncover
_UNDECIDED = 8192  # of these, of all goals and poses together
_FEW = 64  # of each goal at each pose


class LocalStage:
    """Improves candidates; what it needs is compiled in a thread while the global stage runs."""

    def __init__(self, space: Space, fields: Fields) -> None:
        """Start to compile for the candidates of a space."""
        self._space, self._soft = space, Future[SoftCoverage]()
        first = fresh(self._space, np.random.default_rng(0))
        Thread(target=self._prepare, args=(fields, first)).start()

    def _prepare(self, fields: Fields, first: Candidate) -> None:
        try:
            points = fields.points
            count = max(_POINTS // len(points.terms), _FEWEST)
            some = [each[:count] for each in points.points]
            soft = SoftCoverage(fields.scene, points.terms, some, fields.aim, points.radius)
            arrays, where = self._space.arrays(first, fields.aim.detection)
            start = decode(where, self._space.values(first))
            soft.value_and_slope(arrays, start, _DECIDED, soft.first(_UNDECIDED, _FEW))
            self._soft.set_result(soft)
        except BaseException as error:
            self._soft.set_exception(error)

    @property
    def soft(self) -> SoftCoverage:
        """The soft coverage, once it is compiled."""
        return self._soft.result()

    def improve(self, record: SearchRecord, brake: StopToken) -> list[tuple[Candidate, Climb]]:
        """Let the best candidates of a record climb, and add those that keep all rules to it.

        Returns:
            The candidates after their climbs, and how these went.
        """
        some = [c for _, c in record.rivals(_CLIMBED)]
        climbs = list[tuple[Candidate, Climb]]()
        with ThreadPoolExecutor(len(some)) as threads:
            try:
                each = [threads.submit(self.climbed, c, brake) for c in some]
                climbs = [one.result() for one in each]
            except KeyboardInterrupt:
                brake.pulled.set()
        for c, _ in climbs:
            if self._space.apart(c):
                record.take(c)
        return climbs

    def climbed(self, c: Candidate, brake: StopToken) -> tuple[Candidate, Climb]:
        """Return a candidate after a climb, and how it went.

        Only the points count that small moves may cover or uncover, and the climb stays near its
        start.
        """
        soft = self.soft
        arrays, where = self._space.arrays(c, soft.aim.detection)
        start = decode(where, self._space.values(c))
        rules = RingConstraints.of(where, *self._space.box(c), start)
        sample = soft.undecided(arrays, start, _DECIDED, _UNDECIDED, _FEW)
        result = climb(soft, arrays, rules, sample, brake)
        return self._space.moved(c, result.values), result
