"""How a search goes: the rounds of its exchange, the stages of its climbs."""

from dataclasses import dataclass

from ...objectives.criterion import Criterion
from ...objectives.scene import Scene
from .design import Space
from .exchange import Round

FINALISTS = 3  # climbs that the exact count compares, beside the best start


@dataclass(frozen=True)
class Stage:
    """One sharpening: sigmoid width m, points (of all goals and poses together), steps of a climb,
    climbs that go on; and how many variants of those that came from the stage before climb beside
    them."""

    width: float
    points: int
    steps: int
    keep: int
    variants: int = 0


FIXED = (
    Round(2048, 16, 2, 16, 0.2, 16, 1),
    Round(4096, 12, 2, 24, 0.12, 12, 1),
    Round(8192, 8, 4, 24, 0.06, 8, 1),
    Round(16384, 4, 4, 24, 0.03, 4, 1),
    Round(32768, 3, 4, 24, 0.015, 2, 1),
)
FREE = (
    Round(2048, 16, 2, 16, 0.2, 16, 8),
    Round(4096, 6, 10, 16, 0.1, 12, 16),
    Round(8192, 3, 16, 16, 0.06, 8, 16),
    Round(16384, 2, 10, 24, 0.03, 4, 12),
    Round(32768, 2, 4, 24, 0.015, 2, 4),
)
AHEAD = (Round(8192, 3, 2, 24, 0.12, 12, 1), Round(16384, 2, 2, 24, 0.05, 6, 1))
AHEAD_FREE = (Round(8192, 2, 4, 16, 0.06, 8, 16),)


@dataclass(frozen=True)
class Schedule:
    """How a search goes: so many starts, of which the ``rounds`` of an exchange give half; these
    stages; then the exact count of the finalists. Variants are the best unlike ones among so many
    ``draws``, starts among that many at most. A good answer is there soon: the best of the first
    round go through rounds of their own, ``ahead`` of the others, and the best starts are sharpened
    before anything is varied."""

    starts: int = 16
    stages: tuple[Stage, ...] = (
        Stage(0.03, 2048, 24, 8),
        Stage(0.01, 8192, 25, 8),
        Stage(0.02, 4096, 30, 6, variants=16),
        Stage(0.02, 8192, 40, 4, variants=8),
        Stage(0.008, 32768, 80, 3),
    )
    draws: int = 512
    rounds: tuple[Round, ...] = ()
    ahead: tuple[Round, ...] = ()


_FROM_GOOD = (
    Round(8192, 12, 3, 24, 0.2, 16, 2),
    Round(16384, 6, 3, 24, 0.06, 8, 1),
    Round(32768, 3, 4, 24, 0.02, 2, 1),
)
_FROM_GOOD_FREE = (
    Round(8192, 8, 4, 16, 0.2, 12, 8),
    Round(16384, 4, 6, 24, 0.06, 8, 8),
    Round(32768, 2, 4, 24, 0.02, 2, 4),
)
_CLIMB = (
    Stage(0.03, 4096, 30, 4, variants=6),
    Stage(0.02, 8192, 40, 3, variants=3),
    Stage(0.008, 32768, 80, 2),
)
_REFINE = (Stage(0.01, 8192, 25, FINALISTS), Stage(0.008, 32768, 80, FINALISTS))


def usual(scene: Scene, space: Space, aim: Criterion) -> Schedule:
    """How a search goes unless told: an exchange, with moves of sensors where the space leaves
    counts free; and climbs, which only refine what it finds where it goes by all that counts, or
    nearly so."""
    rounds = FIXED if space.layout else FREE
    if exchange_sees(scene, space, aim):
        starts = FINALISTS if exchange_sees_all(scene, space, aim) else 2 * FINALISTS
        return Schedule(starts, _REFINE, rounds=rounds, ahead=AHEAD if space.layout else AHEAD_FREE)
    return Schedule(rounds=rounds)


def short(scene: Scene, space: Space, aim: Criterion) -> Schedule:
    """How a search goes that starts from good setups: where an exchange goes by all that counts, by
    that alone.
    """
    if exchange_sees_all(scene, space, aim):
        return Schedule(FINALISTS, (), rounds=_FROM_GOOD if space.layout else _FROM_GOOD_FREE)
    return Schedule(8, _CLIMB, draws=256)


def exchange_sees_all(scene: Scene, space: Space, aim: Criterion) -> bool:
    """Does an exchange go by all that counts: the mean of zeta, of cones that nothing stands in the
    way of?
    """
    return exchange_sees(scene, space, aim) and scene.occlusion == "ignore" and not scene.obstacles


def exchange_sees(scene: Scene, space: Space, aim: Criterion) -> bool:
    """Does it go by that, but for what it looks up of things in the way?"""
    return aim.plain and scene.over_poses == "mean" and not space.square
