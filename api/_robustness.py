"""What is left of a setup's coverage after failures and under errors of mounting."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import get_args

from ._arguments import number, whole
from ._errors import InputError, input_errors
from ._placement import Placement
from ._scene import Scene
from ._validation import SetupLike, check_scene, check_sight, resolve_setup
from .coverage.choices import Law
from .coverage.rings.mounting_errors import MountingErrors
from .coverage.rings.ring import Setup
from .formats.schema.robustness_models import RobustnessResult
from .objectives.redundancy import Redundancy
from .objectives.robustness import RobustnessSettings
from .objectives.robustness import robustness as counted
from .objectives.scene import Scene as CoreScene
from .objectives.tolerance import Tolerance
from .objectives.verify import VOXEL, Verifier

_MOST_SEEN = 100  # sensors that see one point: more than any setup has use for
_MOST_DRAWS = 100_000


@dataclass(frozen=True, repr=False)
class RobustnessReport(Placement):
    """What failures and errors of mounting leave of the coverage of each target.

    redundancy: shares in [0, 1] that at least 1, 2, ... sensors cover, and ζ after each loss.
    tolerance: ζ in [0, 1] of each drawn mounting. Both in the order of the scene's targets.
    """

    setup: Setup
    scene: Scene
    redundancy: tuple[Redundancy, ...]
    tolerance: tuple[Tolerance, ...]
    name: str = "setup"

    @property
    def records(self) -> tuple[RobustnessResult, ...]:
        """What ``place-rings robustness --json`` prints, one record for each target, in percent."""
        pairs = zip(self.redundancy, self.tolerance, strict=True)
        return tuple(RobustnessResult.of(self.name, self.setup, sure, off) for sure, off in pairs)

    def captions(self) -> list[str]:
        return [f"{r.target}: {100 * r.zeta:.1f} % covered" for r in self.redundancy]

    def rows(self) -> Iterable[Sequence[str]]:
        from .reporting.robustness import robustness_rows

        records = list(self.records)
        for r in self.redundancy:
            yield "target", str(r.target)
        for name, *values in robustness_rows(records):
            yield name, ", ".join(f"{value} %" for value in values)


def mounting_errors(
    position_error_mm: float, direction_error_deg: float, law: Law = "uniform"
) -> MountingErrors:
    """Errors of mounting: of each ring along its link, mm, and of directions, degrees; InputError
    for values that no mount has.
    """
    if law not in get_args(Law):
        raise InputError(f"found {law!r}, allowed: {', '.join(get_args(Law))}", "law")
    _within("position_error_mm", position_error_mm, 0, 1000)
    _within("direction_error_deg", direction_error_deg, 0, 45)
    return MountingErrors(position_error_mm / 1000, math.radians(direction_error_deg), law)


def check_drawing(k: int, draws: int) -> None:
    """Refuse what ``robustness`` cannot tell apart or draw: InputError."""
    _within("k", k, 1, _MOST_SEEN)
    _within("draws", draws, 1, _MOST_DRAWS)


def robustness(
    setup: SetupLike,
    scene: Scene | CoreScene | None = None,
    *,
    k: int = 3,
    draws: int = 100,
    position_error_mm: float = 5.0,
    direction_error_deg: float = 2.0,
    law: Law = "uniform",
    seed: int = 0,
    voxel: float = VOXEL,
    progress: Callable[[int, int], None] | None = None,
) -> RobustnessReport:
    """Count what several sensors cover, what is lost with a sensor or a ring, and ζ under errors of
    mounting.

    Args:
        setup, scene: as for ``verify``.
        k: tell apart up to so many sensors that cover a point, 1 to 100.
        draws: mountings that are drawn.
        position_error_mm: of each ring along its link, either way.
        direction_error_deg: of each ring as a whole and of each sensor on it, either way.
        law: ``uniform`` within these limits, or ``normal`` with the limits as two standard
            deviations.
        seed: of the draws; setups share random draws for a given seed.
        voxel: side of a voxel, m.
        progress: is given the number of counts done, from 0, and of all.

    Raises:
        InputError: as for ``verify``, or for a value out of range.

    Example:
        >>> import place_rings as pr
        >>> report = pr.robustness("n1_8_0", pr.Scene(targets=[pr.Shell(0.5)]), draws=3, voxel=0.05)
        >>> report.redundancy[0].worst_ring.zeta < report.redundancy[0].zeta
        True
    """
    whole("k", k, 1, _MOST_SEEN)
    whole("draws", draws, 1, _MOST_DRAWS)
    whole("seed", seed, 0)
    errors = mounting_errors(position_error_mm, direction_error_deg, law)
    check_drawing(k, draws)
    name, placed, core = resolve_setup(setup, scene)
    check_scene(core, voxel)
    check_sight(core, placed)
    verifier, done, total = Verifier(core, voxel), -1, draws * len(core.poses) * len(core.goals)

    def tell() -> None:
        nonlocal done
        done += 1
        if progress is not None:
            progress(done, total)

    tell()
    with input_errors():
        each = counted(verifier, placed, RobustnessSettings(k, errors, draws, seed), tell)
    sure = tuple(one.redundancy for one in each)
    off = tuple(one.tolerance for one in each)
    return RobustnessReport(placed, Scene.of(core), sure, off, name)


def _within(name: str, value: float, low: float, high: float) -> None:
    number(name, value, f"{low:g} to {high:g}")
    if not low <= value <= high:
        raise InputError(f"found {value:g}, allowed: {low:g} to {high:g}", name)
