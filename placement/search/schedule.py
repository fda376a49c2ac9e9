"""Schedules of a search: the rounds of its exchange and the stages of its local search."""

from dataclasses import dataclass

from ...objectives.criterion import Criterion
from ...objectives.scene import CoreScene
from .design import Space
from .exchange import Round

FINALISTS = 3  # results of local search that the exact count compares, besides the best start


@dataclass(frozen=True)
class Stage:
    """One stage of local search."""

    width: float
    """Width of the sigmoid, m."""
    points: int
    """Points of all goals and poses together."""
    steps: int
    """Most evaluations of one local search."""
    keep: int
    """Number of the best results that continue."""
    variants: int = 0
    """Variants of the previous stage's results that join the local search."""


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
    """Schedule of a search: exchange, stages of local search, exact count of the finalists.

    To give a good answer early, the best candidates of the first round run through rounds of their
    own (``ahead``) before the others continue, and the best starts are refined before any variants
    are drawn.
    """

    starts: int = 16
    """Number of starts, half of them from the exchange."""
    stages: tuple[Stage, ...] = (
        Stage(0.03, 2048, 24, 8),
        Stage(0.01, 8192, 25, 8),
        Stage(0.02, 4096, 30, 6, variants=16),
        Stage(0.02, 8192, 40, 4, variants=8),
        Stage(0.008, 32768, 80, 3),
    )
    """Stages of local search."""
    draws: int = 512
    """Random candidates among which the best diverse ones become variants; largest number of random
    candidates for starts."""
    rounds: tuple[Round, ...] = ()
    """Rounds of the exchange."""
    ahead: tuple[Round, ...] = ()
    """Extra rounds for the best candidates of the first round."""


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


def usual(scene: CoreScene, space: Space, aim: Criterion) -> Schedule:
    """Return the default schedule.

    It starts with an exchange, which moves sensors between rings where the space leaves counts
    free. Local search only refines the result where the exchange evaluates the whole criterion, or
    nearly so.
    """
    rounds = FIXED if space.layout else FREE
    if exchange_sees(scene, space, aim):
        starts = FINALISTS if exchange_sees_all(scene, space, aim) else 2 * FINALISTS
        return Schedule(starts, _REFINE, rounds=rounds, ahead=AHEAD if space.layout else AHEAD_FREE)
    return Schedule(rounds=rounds)


def short(scene: CoreScene, space: Space, aim: Criterion) -> Schedule:
    """Return the schedule for a search that starts from good setups: the exchange alone, where it
    evaluates the whole criterion."""
    if exchange_sees_all(scene, space, aim):
        return Schedule(FINALISTS, (), rounds=_FROM_GOOD if space.layout else _FROM_GOOD_FREE)
    return Schedule(8, _CLIMB, draws=256)


def exchange_sees_all(scene: CoreScene, space: Space, aim: Criterion) -> bool:
    """Return whether the exchange evaluates the whole criterion: the mean of ζ, with cones and
    without occluders."""
    return exchange_sees(scene, space, aim) and scene.occlusion == "ignore" and not scene.obstacles


def exchange_sees(scene: CoreScene, space: Space, aim: Criterion) -> bool:
    """Return whether the exchange evaluates the whole criterion, except that it reads occlusion
    from a table."""
    return aim.plain and scene.over_poses == "mean" and not space.square
