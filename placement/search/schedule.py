"""Rounds of the global stage: how many candidates, points and places each has."""

from dataclasses import dataclass

from ...coverage.occlusion.occlusion_mode import REPORTING
from ...objectives.criterion import Criterion
from ...objectives.scene import Scene
from ..space.design import Space
from .exchange_points import active_poses

_SOFTNESS = 0.02  # of the minimum over poses or losses, per scale of a round
_SOFTEST = 0.0015  # least of that softness


@dataclass(frozen=True)
class Round:
    """One round of the global stage."""

    points: int
    """Points of all goals and poses together."""
    keep: int
    """Number of the best candidates that enter the round."""
    sweeps: int
    """Sweeps over the rings of each candidate."""
    near: int
    """Places tried near a ring's own."""
    scale: float
    """Distance of the near places, as a share of the ring's bounds."""
    anywhere: int = 0
    """Places tried anywhere in the feasible set."""
    pairs: int = 0
    """Pairs of rings that each sweep moves together."""
    guess: bool = False
    """Whether guessed lines of sight decide, too; else they only rank places."""
    trials: int = 0
    """Trials of ruin and recreate for each candidate before the sweeps, where counts are free."""
    library: int = 0
    """Places anywhere in the feasible set from which they combine rings."""
    beside: int = 0
    """Places near each ring of each candidate from which they combine rings."""

    @property
    def softness(self) -> float:
        """Softness of a worst pose or loss."""
        return max(_SOFTNESS * self.scale, _SOFTEST)


Schedule = tuple[Round, ...]


def usual(scene: Scene, space: Space, aim: Criterion, known: bool = False) -> Schedule:
    """Return the schedule of a question; ``known``: for a search that starts from good setups."""
    rounds = any_rings(scene, space) if space.layout is None else given_rings(scene, space, aim)
    return rounds[2:] if known else rounds


def judging_points(schedule: Schedule) -> int:
    """Return the number of points on which candidates are compared: twice those of the last round,
    so that half of them are new to the candidates."""
    return 2 * max(r.points for r in schedule)


def given_rings(scene: Scene, space: Space, aim: Criterion) -> Schedule:
    """Return the schedule for rings whose links and counts are given.

    From round to round points double, and candidates, the distance of the near places and the
    number of others halve. The dearer the test of a place, the fewer candidates start.
    """
    plain = _clear(scene) and aim.plain
    cost = 0.75 if plain else 1.0
    if scene.occlusion in REPORTING:
        cost *= 2  # the first returns of each sensor
    if not aim.plain:
        cost *= 1.5  # counts of sensors, losses, or mountings
    if space.square:
        cost *= 2  # a ring of few wide beams sees many points from aside: more places anywhere
    start, rings = round(24 / cost), len(space.layout.rings) if space.layout else 0
    others = 24 if space.square else 16
    rounds = 5 if plain or active_poses(scene) else 4
    last = rounds - 1
    return tuple(
        Round(
            points=4096 << k,
            keep=max(start >> k, 2),
            sweeps=4 if 0 < k < last else 2 - k // last,
            near=16 + 2 * k,
            scale=0.3 * 0.5**k,
            anywhere=others >> k,
            pairs=0 if k == last else max(rings // 3, 1),
            guess=k < 3 and not space.square,
        )
        for k in range(rounds)
    )


def any_rings(scene: Scene, space: Space) -> Schedule:
    """Return the schedule where the search chooses links and counts.

    From round to round points double, and candidates, places and trials become fewer.
    """
    rounds = 5 if _clear(scene) else 4
    return tuple(
        Round(
            points=4096 << k,
            keep=max(round(28 * 0.6**k), 2),
            sweeps=min(k, 3),
            near=16,
            scale=0.3 * 0.5**k,
            anywhere=16 >> k,
            guess=k < 3,
            trials=0 if k == rounds - 1 else 400 >> k // 2,
            library=3000 >> k,
            beside=40,
        )
        for k in range(rounds)
    )


def _clear(scene: Scene) -> bool:
    """Return whether nothing hides points from sensors: a place is then tested quickly."""
    return scene.occlusion == "ignore" and not scene.obstacles
