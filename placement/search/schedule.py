"""Schedules of a search: the rounds of its exchange."""

from dataclasses import replace

from ...objectives.criterion import Criterion
from ...objectives.scene import CoreScene
from .design import Space
from .exchange_points import active_poses
from .round import Round

FINALISTS = 3  # results of the exchange that the exact count compares
Schedule = tuple[Round, ...]
# with more than _FEW rings, moving one at a time leaves answers of other seeds up to 0.4 points
# lower; with pairs 0.2
_FEW, _PAIRS = 5, 3

# fewer points than 4096 mislead: what is best for them is often not best for the volume (MOVING and
# THOROUGH were not measured with more; BLINDED has pairs, which help more than points), and with
# fewer sweeps the seeds' answers differ more
FIXED = (
    Round(4096, 20, 3, 16, 0.2, 16, 2),
    Round(8192, 14, 4, 24, 0.12, 12, 2),
    Round(16384, 8, 5, 24, 0.06, 8, 1),
    Round(32768, 5, 5, 24, 0.03, 4, 1),
    Round(65536, 3, 5, 24, 0.015, 2, 1),
    Round(131072, 2, 6, 24, 0.006),
)
# candidates have libraries of their own where they must stay different; in one that all share they
# take rings from each other and from those that dropped out just before
FREE = (
    Round(4096, 24, 0, 0, 0.0, trials=150, library=2000, own=True),
    Round(4096, 16, 0, 0, 0.25, trials=150, library=500, beside=60, own=True),
    Round(8192, 16, 0, 0, 0.15, trials=500, library=1000, beside=30),
    Round(8192, 10, 2, 16, 0.1, 4, 2, trials=150, library=500, beside=60, own=True),
    Round(16384, 8, 2, 16, 0.06, 4, 3, trials=500, library=1000, beside=40),
    Round(32768, 4, 3, 16, 0.04, 2, 3, trials=300, library=500, beside=30),
    Round(65536, 3, 3, 16, 0.03, 2, trials=60, library=300, beside=30),
    Round(131072, 2, 5, 20, 0.012),
)
CLOSE_FREE = (
    Round(4096, 32, 0, 0, 0.0, trials=200, library=2000, own=True, guess=True),
    Round(4096, 20, 0, 0, 0.25, trials=200, library=500, beside=60, own=True, guess=True),
    Round(8192, 16, 0, 0, 0.15, trials=500, library=1000, beside=30, guess=True),
    Round(8192, 12, 2, 16, 0.1, 4, 3, trials=200, library=500, beside=50, own=True, guess=True),
    Round(16384, 8, 3, 16, 0.05, 4, 4, trials=400, library=1000, beside=40, guess=True),
    Round(32768, 4, 4, 16, 0.03, 2, 4, trials=150, library=500, beside=30),
    Round(65536, 2, 4, 20, 0.012),
)
# free counts without a library: sensors move between rings, one random move after the other
MOVING = (
    Round(2048, 16, 2, 16, 0.2, 16, 8),
    Round(4096, 6, 10, 16, 0.1, 12, 16),
    Round(8192, 3, 16, 16, 0.06, 8, 16),
    Round(16384, 2, 10, 24, 0.03, 4, 12),
    Round(32768, 2, 4, 24, 0.015, 2, 4),
)
CLOSE = (
    Round(4096, 32, 2, 16, 0.3, 16, 2, guess=True),
    Round(8192, 16, 4, 16, 0.15, 12, 2, guess=True),
    Round(16384, 8, 4, 20, 0.07, 6, 2, guess=True),
    Round(32768, 4, 4, 24, 0.03, 2, 1),
    Round(65536, 2, 1, 24, 0.01),
)
# for losses and errors CLOSE gives no better answers, only later ones
BRISK = (
    Round(4096, 16, 3, 16, 0.3, 12, 1, guess=True),
    Round(8192, 8, 4, 16, 0.15, 8, 1, guess=True),
    Round(16384, 4, 5, 20, 0.07, 4, 1, guess=True),
    Round(32768, 3, 3, 24, 0.03, 2, 1, guess=True),
    Round(65536, 2, 2, 24, 0.01),
)
# a ring of few square beams sees many points from aside, where guesses are wrong so often that they
# only rank places here; more places anywhere, and pairs, help more than more candidates
WIDE = (
    Round(4096, 24, 2, 8, 0.3, 48, pairs=2),
    Round(8192, 8, 2, 12, 0.15, 24, pairs=2),
    Round(16384, 4, 3, 20, 0.07, 4, pairs=2),
    Round(65536, 2, 4, 24, 0.02, 2),
)
CLOSE_WIDE = (
    Round(4096, 11, 3, 8, 0.3, 48),
    Round(8192, 5, 3, 12, 0.15, 24, pairs=1),
    Round(16384, 2, 3, 20, 0.07, 4, 1),
    Round(32768, 2, 2, 20, 0.03, 2, 1),
    Round(65536, 2, 2, 20, 0.01),
)
# each place needs the first return of each of its sensors, which takes most of the time
BLINDED = (
    Round(2048, 20, 2, 8, 0.3, 16, pairs=1),
    Round(4096, 8, 2, 8, 0.2, 12, pairs=2),
    Round(8192, 4, 2, 12, 0.15, 8, pairs=2),
    Round(16384, 2, 4, 16, 0.07, 4, 1),
    Round(49152, 2, 4, 20, 0.02, 2, 1),
)
THOROUGH = (
    Round(2048, 20, 3, 16, 0.2, 16, 1, guess=True),
    Round(4096, 12, 5, 16, 0.12, 12, 2, guess=True),
    Round(8192, 8, 7, 20, 0.06, 6, 1, guess=True),
    Round(16384, 4, 8, 24, 0.03, 2, 1, guess=True),
    Round(65536, 2, 3, 24, 0.008),
)
WORST = (
    Round(8192, 12, 3, 16, 0.2, 16, 1),
    Round(16384, 6, 5, 20, 0.08, 6, 1),
    Round(32768, 3, 8, 24, 0.03, 2, 1),
    Round(65536, 2, 6, 24, 0.012),
)
_FROM_GOOD = (
    Round(8192, 12, 3, 24, 0.2, 16, 2),
    Round(16384, 6, 3, 24, 0.06, 8, 1),
    Round(32768, 3, 4, 24, 0.02, 2, 1),
)
_FROM_GOOD_FREE = (
    Round(8192, 6, 2, 16, 0.15, 4, trials=200, library=1500, beside=40),
    Round(16384, 3, 3, 16, 0.04, 2, trials=150, library=300, beside=40),
    Round(32768, 2, 4, 24, 0.015),
)
_FROM_GOOD_MOVING = (
    Round(8192, 8, 4, 16, 0.2, 12, 8),
    Round(16384, 4, 6, 24, 0.06, 8, 8),
    Round(32768, 2, 4, 24, 0.02, 2, 4),
)


def usual(scene: CoreScene, space: Space, aim: Criterion) -> Schedule:
    """Return the default schedule.

    Rounds that guess do so only where bodies hide points and blind no sensor.
    """
    clear = scene.occlusion == "ignore" and not scene.obstacles
    mean = aim.plain and scene.over_poses == "mean"
    if space.layout is None:
        if scene.rules.shared_tilt:
            return MOVING
        return FREE if clear and mean else CLOSE_FREE
    rounds = _given(scene, space, aim, clear and mean)
    return _with_pairs(rounds) if len(space.layout.rings) > _FEW else rounds


def _given(scene: CoreScene, space: Space, aim: Criterion, clear_mean: bool) -> Schedule:
    """Return the default schedule for given rings; ``clear_mean`` where nothing hides points from
    them, and the mean over all poses counts."""
    if clear_mean and not space.square:
        return FIXED
    if active_poses(scene):
        return WORST
    if aim.seen > 1 or aim.losing == "ring":
        return THOROUGH
    if scene.occlusion == "blind":
        return BLINDED
    if space.square:
        return WIDE if clear_mean else CLOSE_WIDE
    return CLOSE if aim.plain else BRISK


def _with_pairs(rounds: Schedule) -> Schedule:
    """Return a schedule that moves pairs of rings in all rounds but the last."""
    return (*(replace(r, moves=0, pairs=_PAIRS) for r in rounds[:-1]), rounds[-1])


def short(scene: CoreScene, space: Space, aim: Criterion) -> Schedule:
    """Return the schedule for a search that starts from good setups."""
    if space.layout is not None:
        return _FROM_GOOD
    return _FROM_GOOD_MOVING if scene.rules.shared_tilt else _FROM_GOOD_FREE
