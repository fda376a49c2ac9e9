"""What the options of redundancy and tolerance mean for a search."""

import math

from ...coverage.choices import Losing
from ...coverage.rings.mounting_errors import MountingErrors
from ...formats.errors import UserError
from ...objectives.criterion import Criterion, check_criterion
from ...objectives.scene import Scene

POSITION_MM, DIRECTION_DEG = 5.0, 2.0  # errors of mounting where none are given
_MOST_SOUGHT = 10  # the same for a search, whose time grows with it


def _within(option: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high:
        raise UserError(f"{option}: found {value:g}, allowed: {low:g} to {high:g}")


def mounting_errors(position_mm: float, direction_deg: float) -> MountingErrors:
    """What ``--position-error-mm`` and ``--direction-error-deg`` mean; UserError for what no mount
    has.
    """
    _within("--position-error-mm", position_mm, 0, 1000)
    _within("--direction-error-deg", direction_deg, 0, 45)
    return MountingErrors(position_mm / 1000, math.radians(direction_deg))


def resolve_aim(
    scene: Scene,
    redundancy: int,
    losing: Losing | None,
    tolerant: bool,
    position_mm: float | None,
    direction_deg: float | None,
) -> Criterion:
    """What ``--redundancy``, ``--losing``, ``--tolerant`` and its errors mean together, for a
    search in ``scene``.
    """
    _within("--redundancy", redundancy, 1, _MOST_SOUGHT)
    if losing is not None and (tolerant or redundancy > 1):
        raise UserError(
            f"--losing: found {losing}, allowed: only without --redundancy and --tolerant"
        )
    if scene.over_poses == "worst" and (losing is not None or tolerant or redundancy > 1):
        raise UserError(
            "--worst: found with another aim, allowed: only without --redundancy, --losing and"
            " --tolerant"
        )
    try:
        check_criterion(scene, Criterion(losing=losing))
    except ValueError as error:
        raise UserError(f"--losing: {error}") from error
    if not tolerant:
        for option, value in (
            ("--position-error-mm", position_mm),
            ("--direction-error-deg", direction_deg),
        ):
            if value is not None:
                raise UserError(f"{option}: found {value:g}, allowed: only with --tolerant")
        return Criterion(redundancy, losing=losing)
    errors = (
        POSITION_MM if position_mm is None else position_mm,
        DIRECTION_DEG if direction_deg is None else direction_deg,
    )
    return Criterion(redundancy, mounting_errors(*errors))
