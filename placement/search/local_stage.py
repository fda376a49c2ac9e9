"""The local stage of a search: its best candidates improve by nlopt on the soft coverage."""

from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from ...objectives.criterion import Criterion
from ...objectives.parameterization import decode, encode
from ...objectives.soft_coverage import SoftCoverage
from ...objectives.target_points import TargetPoints
from .design import Candidate, Space
from .local_search import Climb, Effort, Rules, climb
from .stop_token import StopToken

_POINTS = 65536  # of all goals and poses together, as far as they were drawn
_FEWEST = 256  # of each goal at each pose
_DECIDED = 0.01  # m, width by which points are chosen that small moves may cover or uncover
_UNDECIDED = 16384  # of these, of all goals and poses together
_FEW = 64  # of each goal at each pose


@dataclass(frozen=True)
class LocalStage:
    """Improves candidates of one space; compiles while the global stage runs."""

    space: Space
    """The setups to choose from."""
    soft: "Future[SoftCoverage]"
    """The soft coverage, once it is compiled."""

    @staticmethod
    def of(
        space: Space,
        points: TargetPoints,
        aim: Criterion,
        first: Candidate,
        pool: ThreadPoolExecutor,
    ) -> "LocalStage":
        """Start to compile in a thread of ``pool``, for setups like ``first``."""
        count = max(_POINTS // len(points.terms), _FEWEST)
        some = [each[:count] for each in points.points]
        arrays, where = space.arrays(first)

        def prepare() -> SoftCoverage:
            soft = SoftCoverage(space.scene, points.terms, some, aim)
            start = decode(where, space.values(first))
            soft.value_and_slope(arrays, start, _DECIDED, soft.first(_count(soft)))
            return soft

        return LocalStage(space, pool.submit(prepare))

    def improve(self, c: Candidate, brake: StopToken) -> tuple[Candidate, Climb]:
        """Return a candidate after a climb, and how it went.

        Only the points count that small moves may cover or uncover, and the climb stays near its
        start.
        """
        soft, (arrays, where) = self.soft.result(), self.space.arrays(c)
        start = decode(where, self.space.values(c))
        rules = Rules.of(where, *self.space.box(c), start)
        sample = soft.undecided(arrays, start, _DECIDED, _count(soft))
        result = climb(soft, arrays, rules, sample, brake, Effort())
        return self._moved(c, result.values), result

    def _moved(self, c: Candidate, values: Float[np.ndarray, "3 R"]) -> Candidate:
        """Return the candidate with other positions, tilts and phases of its rings."""
        where, new = self.space.stretch(c), c.values.copy()
        new[1:, c.rings] = values[1:, c.rings]
        if self.space.scene.rules.shared_tilt and len(c.rings):
            new[1] = (where.sign * values[1])[c.rings[0]]
        there = replace(c, values=new)
        along = encode(where, self.space.values(there), values[0])
        return replace(c, values=np.concatenate([along[None, : len(c.segment)], new[1:]]))


def _count(soft: SoftCoverage) -> int:
    """Return the number of undecided points of each term."""
    return max(_UNDECIDED // len(soft.all.points), _FEW)
