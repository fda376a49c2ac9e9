"""The options of a search and of a redesign: each is defined here, for Python and the command."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal, Optional

from ...coverage.choices import Losing
from ...coverage.definitions.errors import InputError
from ...coverage.definitions.options import Number, Options, Seconds, Seed, Voxel, Whole

if TYPE_CHECKING:
    from ...coverage.detection.detection import Detection
    from ...coverage.rings.ring import Setup

Device = Literal["auto", "cpu", "gpu"]
Count = Annotated[int | None, Whole(1, 200)]
_WITHIN = 1.0  # default margin of the fewest rings, percentage points


@dataclass(frozen=True, kw_only=True)
class SearchOptions(Options):
    """Options of a search."""

    rings_per_link: Count = None
    """Rings on each link, besides one on the tool (``rings``: in all). Default: 2."""
    sensors_per_ring: Count = None
    """Sensors on each ring, with ``rings_per_link`` or ``rings``. Default: 16, or the nearest
    number that the rules of the scene allow."""
    sensors: Annotated[int | None, Whole(1, 2000)] = None
    """Number of sensors to place, in the fewest rings whose coverage is near the best; the search
    also divides the sensors among them. See ``any_rings`` and ``rings``."""
    rings: Annotated[int | None, Whole(1, 1000)] = None
    """Number of rings to place; the search chooses their links. With ``sensors`` it also divides
    the sensors among them; otherwise all have ``sensors_per_ring``. Default: two on each link and
    one on the tool, or with ``sensors`` the fewest that suffice."""
    any_rings: bool = False
    """With ``sensors``: the highest coverage, in as many rings as that takes, often many small
    ones. Takes about half the time."""
    fewest_rings: bool = False
    """What ``sensors`` alone does; accepted for earlier scripts."""
    within: Annotated[
        float | None, Number("0 or more and below 100 (percentage points)", ge=0, lt=100)
    ] = None
    """With ``sensors``: largest loss of coverage that fewer rings may cost, in percentage points.
    Default: 1."""
    reach: Annotated[float | None, Number("above 0 and below 100 (percent)", gt=0, lt=100)] = None
    """Coverage to reach in percent; find the fewest sensors that reach it."""
    detect: Optional["Detection"] = None
    """Maximise the expected share of the targets in which a test piece is detected in time, instead
    of the coverage. Not with ``losing``, ``tolerant`` and ``gap``; with ``redundancy`` as many
    sensors must detect it."""
    redundancy: Annotated[int, Whole(1, 10)] = 1  # the time of a search grows with it
    """Number of sensors that must see a point for it to count as covered."""
    losing: Losing | None = None
    """Maximise the coverage that remains when the most important ring or sensor fails."""
    tolerant: bool = False
    """Maximise the mean coverage over random mounting errors."""
    position_error_mm: Annotated[float | None, Number("0 to 1000", ge=0, le=1000)] = None
    """With ``tolerant``: largest error of a ring along its link, in mm. Default: 5."""
    direction_error_deg: Annotated[float | None, Number("0 to 45", ge=0, le=45)] = None
    """With ``tolerant``: largest error in the direction of a ring and of each sensor, in degrees.
    Default: 2."""
    gap: bool = False
    """Also compute an upper bound on what any layout within the same budget and rules could cover,
    and with ``reach`` the fewest sensors that any layout needs; takes some minutes more. Refused
    where it would say nothing. Not with ``tolerant``."""
    device: Device = "auto"
    """Use an accelerator where JAX finds one (auto), demand one (gpu), or do without (cpu). It
    serves searches of rings with given links and counts, for at most four pairs of a
    target and a pose."""
    effort: Annotated[float, Number("0.1 to 100", ge=0.1, le=100)] = 1.0
    """Number of candidates of the global stage, as a multiple of the usual one: 0.2 for a quick
    look, 3 for the last tenth of a point where the search chooses the rings. Time grows with it."""
    seed: Seed = 0
    """Random seed; the same seed gives the same answer."""
    searches: Annotated[int, Whole(1, 1000)] = 1
    """Number of searches with different random seeds, one after the other; the best answer counts,
    and all are shown. With ``sensors`` only beside ``rings`` or ``any_rings``; not with
    ``reach``."""
    time: Seconds = None
    """Time limit of the search in seconds. Default: none; the search ends by its own schedule."""
    voxel: Voxel = 0.01
    """Edge length in metres of the small cubes (voxels) in which coverage is counted."""
    start: Sequence["Setup"] = ()
    """Setups to start from, in addition to random ones."""

    def __post_init__(self) -> None:
        """Raise InputError for values out of range, or that contradict each other."""
        super().__post_init__()
        object.__setattr__(self, "start", _setups(self.start))
        for name, line, *others in self._contradictions():
            raise InputError(line, name, others=tuple(others))

    @property
    def limit(self) -> float:
        """Limit of time, s; infinite without one."""
        return math.inf if self.time is None else self.time

    @property
    def fewest(self) -> bool:
        """Whether the search is for the fewest rings."""
        return self.sensors is not None and self.rings is None and not self.any_rings

    @property
    def margin(self) -> float:
        """Largest loss of coverage for fewer rings, in [0, 1]."""
        return (_WITHIN if self.within is None else self.within) / 100

    def _contradictions(self) -> Iterator[tuple[str, ...]]:
        """Yield options that contradict others: the name, what is wrong, and the others' names."""
        reach, sensors, rings = self.reach, self.sensors, self.rings
        one = "use only one of them"
        if reach is not None and sensors is not None:
            yield "reach", f"found {reach:g} with sensors {sensors}; {one}", "sensors"
        if reach is not None or sensors is not None:
            beside = "reach" if reach is not None else f"sensors {sensors}"
            # the rule of a scene that limits what an option fixes
            rules = {"rings_per_link": "max_rings_per_link", "sensors_per_ring": "sensors_per_ring"}
            for name, rule in rules.items():
                if (value := getattr(self, name)) is not None:
                    line = f"found {value} with {beside}, where the search chooses the rings; {one}"
                    yield name, f"{line}, or set rules.{rule} in the scene", "reach", "sensors"
        if rings is not None and self.rings_per_link is not None:
            line = f"found {rings} with rings_per_link {self.rings_per_link}; {one}"
            yield "rings", line, "rings_per_link"
        if self.within is not None and not self.fewest:
            line = "allowed: only with sensors, without rings and any_rings"
            yield "within", f"found {self.within:g}, {line}", "sensors", "any_rings", "rings"
        for name in ("fewest_rings", "any_rings"):
            for other in ("rings", "reach") if getattr(self, name) else ():
                if (value := getattr(self, other)) is not None:
                    yield name, f"found with {other} {value:g}; {one}", other
            if getattr(self, name) and sensors is None:
                yield name, "found without sensors; state their number", "sensors"
        if self.fewest_rings and self.any_rings:
            yield "fewest_rings", f"found with any_rings; {one}", "any_rings"
        if self.losing is not None and (self.tolerant or self.redundancy > 1):
            line = f"found {self.losing}, allowed: only without redundancy and tolerant"
            yield "losing", line, "redundancy", "tolerant"
        for name in ("losing", "tolerant", "gap") if self.detect is not None else ():
            if getattr(self, name):
                yield "detect", f"found with {name}; {one}", name
        if self.detect is not None and 1 < self.redundancy != self.detect.at_least > 1:
            line = f"found {self.redundancy} with detect by {self.detect.at_least} sensors; {one}"
            yield "redundancy", line, "detect"
        if self.searches > 1 and (self.fewest or reach is not None):
            line = "allowed: 1 with reach, and with sensors without any_rings or rings"
            others = "reach", "sensors", "any_rings", "rings"
            yield "searches", f"found {self.searches}, {line}", *others
        for name in ("position_error_mm", "direction_error_deg"):
            if (error := getattr(self, name)) is not None and not self.tolerant:
                yield name, f"found {error:g}, allowed: only with tolerant", "tolerant"


def _setups(start: Any) -> "tuple[Setup, ...]":
    """Return the setups to start from; raise InputError for anything else."""
    setups = tuple(start) if isinstance(start, Iterable) else (start,)
    if setups:
        from ...coverage.rings.ring import Setup

        for setup in setups:
            if not isinstance(setup, Setup):
                raise InputError(f"found {setup!r}, allowed: a list of Setups", "start")
    return setups


@dataclass(frozen=True, kw_only=True)
class ImproveOptions(Options):
    """Options of a redesign."""

    changes: Annotated[int, Whole(1, 20)] = 3
    """Largest number of rings to change."""
    add_sensors: Annotated[int, Whole(0, 1000)] = 0
    """Largest number of sensors to add."""
    seed: Seed = 0
    """Random seed; the same seed gives the same answer."""
    time: Seconds = None
    """Time limit of the search in seconds. Default: none; the search ends by its own schedule."""
    voxel: Voxel = 0.01
    """Edge length in metres of the small cubes (voxels) in which coverage is counted."""

    @property
    def limit(self) -> float:
        """Limit of time, s; infinite without one."""
        return math.inf if self.time is None else self.time
