"""Robustness of a setup's coverage against failures and mounting errors."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

from ._errors import input_errors
from ._options import called_with
from ._placement import Placement
from ._scene import Scene
from ._validation import SetupCall, check_scene, resolve_setup
from .coverage.rings.ring import Setup
from .formats.schema.robustness_models import RobustnessResult
from .objectives.options import RobustnessOptions
from .objectives.redundancy import Redundancy
from .objectives.robustness import robustness as counted
from .objectives.tolerance import Tolerance
from .objectives.verify import Verifier


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
        Redundancy and tolerance for each target.

    Raises:
        InputError: as in ``verify``, or for a value out of range.

    Example:
        >>> import place_rings as pr
        >>> report = pr.robustness("n1_8_0", pr.Scene(targets=[pr.Shell(0.5)]), draws=3, voxel=0.05)
        >>> report.redundancy[0].worst_ring.zeta < report.redundancy[0].zeta
        True
    """
    name, placed, core = resolve_setup(call.setup, call.scene)
    check_scene(core, call.voxel)
    verifier, done = Verifier(core, call.voxel), -1
    total = call.draws * len(core.poses) * len(core.targets)

    def tell() -> None:
        nonlocal done
        done += 1
        if call.progress is not None:
            call.progress(done, total)

    tell()
    with input_errors():
        each = counted(verifier, placed, call, tell)
    sure = tuple(one.redundancy for one in each)
    off = tuple(one.tolerance for one in each)
    return RobustnessReport(placed, Scene.of(core), sure, off, name)
