"""Robustness of a setup's coverage against failures and mounting errors."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import get_args

from ._arguments import number, whole
from ._errors import InputError, input_errors
from ._placement import Placement
from ._scene import Scene
from ._validation import SetupLike, check_scene, resolve_setup
from .coverage.choices import Law
from .coverage.rings.mounting_errors import MountingErrors
from .coverage.rings.ring import Setup
from .formats.schema.robustness_models import RobustnessResult
from .objectives.redundancy import Redundancy
from .objectives.robustness import RobustnessSettings
from .objectives.robustness import robustness as counted
from .objectives.scene import CoreScene
from .objectives.tolerance import Tolerance
from .objectives.verify import VOXEL, Verifier

_MOST_SEEN = 100  # sensors that cover one point; no real setup has more
_MOST_DRAWS = 100_000


@dataclass(frozen=True, repr=False)
class RobustnessReport(Placement):
    """Coverage of each target after failures and under mounting errors."""

    setup: Setup
    """The rings."""
    scene: Scene
    """Scene of the counts."""
    redundancy: tuple[Redundancy, ...]
    """For each target: shares in [0, 1] that at least 1, 2, ... sensors cover, and ζ without each
    ring or sensor."""
    tolerance: tuple[Tolerance, ...]
    """For each target: ζ in [0, 1] for each draw of mounting errors."""
    name: str = "setup"
    """Name of the setup."""

    @property
    def records(self) -> tuple[RobustnessResult, ...]:
        """Records that ``place-rings robustness --json`` prints, one for each target, percent."""
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
    """Return the distribution of mounting errors.

    Args:
        position_error_mm: limit of each ring's error along its link, mm.
        direction_error_deg: limit of the errors of directions, degrees.
        law: ``uniform`` or ``normal``.

    Raises:
        InputError: for an unknown law, or limits that no mount has.
    """
    if law not in get_args(Law):
        raise InputError(f"found {law!r}, allowed: {', '.join(get_args(Law))}", "law")
    _within("position_error_mm", position_error_mm, 0, 1000)
    _within("direction_error_deg", direction_error_deg, 0, 45)
    return MountingErrors(position_error_mm / 1000, math.radians(direction_error_deg), law)


def check_drawing(k: int, draws: int) -> None:
    """Check the numbers of sensors and of draws of ``robustness``.

    Raises:
        InputError: for a value out of range.
    """
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
    """Count k-coverage, coverage without each sensor or ring, and coverage under mounting errors.

    Args:
        setup, scene: as in ``verify``.
        k: largest number of sensors in the k-coverage, 1 to 100.
        draws: number of random mounting errors, 1 to 100,000.
        position_error_mm: limit of each ring's error along its link, in both directions, mm.
        direction_error_deg: limit of the errors of direction, degrees: of each ring as a whole and
            of each sensor on it.
        law: ``uniform`` within these limits, or ``normal`` with the limits at two standard
            deviations.
        seed: random seed; setups share random draws for a given seed.
        voxel: side of a voxel, m.
        progress: receives the number of finished counts, from 0, and the number of all.

    Returns:
        Redundancy and tolerance for each target.

    Raises:
        InputError: as in ``verify``, or for a value out of range.

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
