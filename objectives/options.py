"""The options of counts, reports and simulations: defined once, for Python and the command."""

from dataclasses import dataclass
from math import radians
from typing import TYPE_CHECKING, Annotated

from ..coverage.choices import Disturbance, Law, Rule
from ..coverage.definitions.errors import InputError
from ..coverage.definitions.options import Draws, Number, Options, Seed, Voxel, Whole

if TYPE_CHECKING:
    from ..coverage.rings.mounting_errors import Mountings


@dataclass(frozen=True, kw_only=True)
class ObjectOptions(Options):
    """Options of the bounds of unseen objects."""

    smallest_object: bool = False
    """Bound the largest unseen sphere and vertical rod with their centre in each target (d_e of ISO
    13855:2024, as geometry)."""
    # our assumption: about the length of a forearm
    rod_length: Annotated[float, Number("0.05 to 3 (m)", ge=0.05, le=3)] = 0.3
    """With ``smallest_object``: length of the rod in metres."""

    def __post_init__(self) -> None:
        """Raise InputError for values out of range, or a rod of bounds that are not computed."""
        super().__post_init__()
        if not self.smallest_object and self.rod_length != ObjectOptions.rod_length:
            line = f"found {self.rod_length:g}, allowed: only with smallest_object"
            raise InputError(line, "rod_length", others=("smallest_object",))


@dataclass(frozen=True, kw_only=True)
class VerifyOptions(ObjectOptions):
    """Options of a count, or of a guaranteed interval."""

    voxel: Annotated[float | None, Number("a positive number of metres", gt=0)] = None
    """Edge length in metres of the small cubes (voxels) in which coverage is counted. Default:
    0.01. With ``rule`` certified: use cells of this size only, instead of refining them."""
    rule: Rule = "sampled"
    """How to count. sampled: voxels of which a drawn point is covered; the error is computed.
    centre: voxels whose centre is covered. touch: voxels of which any part is covered, as in the
    paper. certified: compute an interval that is guaranteed to hold the coverage."""
    width: Annotated[
        float | None, Number("above 0 and at most 100 (percentage points)", gt=0, le=100)
    ] = None
    """With ``rule`` certified: width of the interval in percentage points. Default: 0.1."""
    memory: Annotated[float | None, Number("GB, 0.01 or more", ge=0.01)] = None
    """Memory for sets of voxels in GB; larger sets are processed in parts. Default: half of the
    free memory."""
    workers: Annotated[int | None, Whole(1, 1024)] = None
    """Number of processes among which the poses of a motion are divided. Default: 1 in Python,
    where a script must start more under ``if __name__ == "__main__"``; the command uses all
    processors for more than 16 poses."""

    def __post_init__(self) -> None:
        """Raise InputError for values out of range, or a width of a count."""
        super().__post_init__()
        if self.width is not None and not self.certified:
            line = f"found {self.width:g}, allowed: only with rule certified"
            raise InputError(line, "width", others=("rule",))

    @property
    def certified(self) -> bool:
        """Whether an interval is computed."""
        return self.rule == "certified"

    @property
    def share(self) -> float:
        """Width of the interval, in [0, 1]; 0 where the size of the cells decides."""
        default = 0.1 if self.certified and self.voxel is None else 0.0
        return (default if self.width is None else self.width) / 100


@dataclass(frozen=True, kw_only=True)
class RobustnessOptions(Options):
    """Options of robustness."""

    k: Annotated[int, Whole(1, 100)] = 3  # no real setup has more sensors that cover one point
    """Count the shares that at least 1, 2, … up to K sensors cover."""
    draws: Draws = 100
    """Number of random mountings."""
    position_error_mm: Annotated[float, Number("0 to 1000", ge=0, le=1000)] = 5.0
    """Largest error of each ring along its link, in mm."""
    direction_error_deg: Annotated[float, Number("0 to 45", ge=0, le=45)] = 2.0
    """Largest error in direction, in degrees: of each ring about three axes, and of each sensor on
    it about two."""
    law: Law = "uniform"
    """Distribution of the errors. uniform: within these limits. normal: the limits are two standard
    deviations."""
    seed: Seed = 0
    """Random seed; the same seed gives the same answer."""
    voxel: Voxel = 0.01
    """Edge length in metres of the small cubes (voxels) in which coverage is counted."""

    @property
    def mountings(self) -> "Mountings":
        """The mountings to draw."""
        from ..coverage.rings.mounting_errors import Mountings

        position, direction = self.position_error_mm / 1000, radians(self.direction_error_deg)
        return Mountings(position, direction, self.law, self.draws, self.seed)


@dataclass(frozen=True, kw_only=True)
class FiringOptions(Options):
    """Options of a firing schedule."""

    reach: Disturbance = "reflection"
    """Which sensors may disturb each other. direct: one lights the other's window. overlap: their
    beams overlap, too. reflection: they meet on a body of the robot or the cell, too."""
    rate: Annotated[float | None, Number("Hz, above 0, at most 10,000", gt=0, le=10_000)] = None
    """Rate in Hz that every sensor should keep: say which rings do, and how many sensors would."""


@dataclass(frozen=True, kw_only=True)
class ReportOptions(ObjectOptions):
    """Options of a report."""

    draws: Draws = 100
    """Number of random mountings in the tolerance section."""
    seed: Seed = 0
    """Random seed; the same seed gives the same answer."""
    revision: str = ""
    """Revision of the report, for its cover."""
    pdf: bool = False
    """Print report.pdf too, by a browser on PATH (Chromium, Chrome, Edge or Brave)."""
    voxel: Voxel = 0.01
    """Edge length in metres of the small cubes (voxels) in which coverage is counted."""
