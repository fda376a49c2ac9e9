"""Robustness of a setup's coverage against failures and mounting errors."""

import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

from ._arguments import stepwise
from ._errors import input_errors
from ._options import called_with
from ._placement import Placement
from ._validation import SetupCall, check_scene, resolve_setup
from .coverage.rings.ring import Setup
from .objectives.options import RobustnessOptions
from .objectives.robustness import Robustness
from .objectives.robustness import robustness as counted
from .objectives.scene import Scene
from .objectives.verify import Verifier


@dataclass(frozen=True, repr=False)
class RobustnessReport(Placement):
    """Coverage of each target after failures and under mounting errors."""

    setup: Setup
    """The rings."""
    scene: Scene
    """Scene of the counts."""
    records: tuple[Robustness, ...]
    """Record of each target, as ``place-rings robustness --json`` prints it, in shares."""
    name: str = "setup"
    """Name of the setup."""

    def __getattr__(self, name: str) -> tuple[Robustness, ...]:
        """Return the records by one of their former names."""
        if name not in ("redundancy", "tolerance"):
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        warnings.warn(f"{name} is now part of records", DeprecationWarning, stacklevel=2)
        return self.records

    def captions(self) -> list[str]:
        return [f"{r.target}: {100 * r.zeta:.1f} % covered" for r in self.records]

    def rows(self) -> Iterable[Sequence[str]]:
        from .reporting.tables import robustness_rows

        for r in self.records:
            yield "target", str(r.target)
        for name, *values in robustness_rows(self.records):
            yield name, ", ".join(f"{value} %" for value in values)


@dataclass(frozen=True)
class RobustnessCall(RobustnessOptions, SetupCall):
    """A call of ``robustness``."""

    progress: Callable[[int, int], None] | None = field(default=None, kw_only=True)
    """Receives the number of finished counts, from 0, and the number of all."""


@called_with(RobustnessCall)
def robustness(call: RobustnessCall) -> RobustnessReport:
    """Count k-coverage, coverage without each sensor or ring, and coverage under mounting errors.

    Setups share random draws for a given seed.

    Returns:
        Redundancy and tolerance for each target, in ``records``.

    Raises:
        InputError: as in ``verify``, or for a value out of range.

    Example:
        >>> import place_rings as pr
        >>> report = pr.robustness("n1_8_0", pr.Scene(targets=[pr.Shell(0.5)]), draws=3, voxel=0.05)
        >>> report.records[0].worst_ring.zeta < report.records[0].zeta
        True
    """
    name, placed, core = resolve_setup(call.setup, call.scene)
    check_scene(core, call.voxel)
    verifier = Verifier(core, call.voxel)
    tell = stepwise(call.progress, call.draws * len(core.poses) * len(core.targets))
    with input_errors():
        records = counted(verifier, name, placed, call, tell)
    return RobustnessReport(placed, core, records, name)
