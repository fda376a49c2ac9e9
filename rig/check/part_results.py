"""Results of the parts of a check, from the readings of their steps."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TypeVar

import numpy as np
from jaxtyping import Float

from ...coverage.rings.ring import Setup
from ..mount.as_built import AsBuilt
from ..mount.cell_frame import cell_is_turned
from ..mount.fit import fit_mount
from ..mount.hand_sweep import Waving, waved
from ..mount.stop_plan import require_cell
from ..rod.coverage_estimate import RodCheck, check_rod
from ..sensing.readings import ABSENT, Readings, Stops, at_stops, joined, zones_at_stops
from ..sensing.zone_grid import zone_grid, zoned
from ..sensing.zone_state import frozen_zones
from ..session.gathering import Gathered
from .doubt import Doubt, doubt
from .planned_check import PlannedCheck
from .port_matching import Ports, by_lines, by_pattern, by_waving, exchanged
from .procedure import Span, skipped, spans, unfinished
from .self_check import SelfCheck, self_check, sensor_names

_Result = TypeVar("_Result")


@dataclass
class PartResults:
    """Results of the parts that ran."""

    self_check: SelfCheck | None = None
    """Result of the self check; None if it did not run."""
    waves: dict[int, Waving] = field(default_factory=dict)
    """Result of waving for each ring number that a hand passed over."""
    stops: Sequence[int] = ()
    """Numbers of the stops with readings."""
    skipped_stops: Mapping[int, str] = field(default_factory=dict)
    """Why stops were skipped, by their numbers."""
    skipped_poses: Mapping[int, str] = field(default_factory=dict)
    """Why poses of the coverage check were skipped, by their numbers."""
    ports: Ports = field(default_factory=dict)
    """Ports that belong to other rings than those they were given for."""
    cell_turned: bool = False
    """Whether the readings at the stops fit the cell turned by 180° about z; then no mounting is
    estimated."""
    grids: Mapping[int, tuple[int, int]] = field(default_factory=dict)
    """Numbers of zones of each sensor, in the frames and as proposed, of rings where they differ.
    """
    frozen: Sequence[str] = ()
    """Sensors of which too many zones read the same distance at all poses, and how many."""
    cut_short: float | None = None
    """Duration of a self check that was cut off, s; None if it was completed, or never began."""
    read: Stops | None = None
    """Readings at these stops."""
    built: AsBuilt | None = None
    """The rings as built, estimated from these readings."""
    rods: Sequence[RodCheck] = ()
    """Result of the rod trials in each target."""
    doubt: Doubt | None = None
    """Doubtful readings of each sensor while the robot stood still; None without a part in which it
    did."""
    failures: list[str] = field(default_factory=list)
    """Why a part has no result, one line each."""


def part_results(check: PlannedCheck, gathered: Gathered) -> PartResults:
    """Evaluate all parts of a check."""
    plans, parts = check.plans, _Parts(check, gathered)
    done = PartResults(
        stops=parts.stops,
        skipped_stops=skipped(gathered.said, "mount"),
        skipped_poses=skipped(gathered.said, "pose"),
        ports=parts.ports,
        cell_turned=parts.cell_turned,
        grids=parts.grids(),
        frozen=parts.frozen(),
        cut_short=parts.cut_short,
    )

    def part(name: str, work: Callable[[], _Result]) -> _Result | None:
        try:
            return work()
        except ValueError as error:
            done.failures.append(f"{name}: {error}")
            return None

    done.doubt = parts.doubt()
    if plans.seconds is not None:
        done.self_check = part("self check", parts.self_check)
    for ring in parts.waved:
        wave = part("self check", partial(parts.waving, ring))
        if wave is not None:
            done.waves[ring] = wave
    if plans.mount is not None:
        done.read = parts.read()
        if not done.cell_turned:
            done.built = part("mount check", lambda: parts.built(done.read))
    if plans.rods:
        done.rods = part("coverage check", parts.rods) or []
    return done


class _Parts:
    """Evaluates each part from the readings of its steps."""

    def __init__(self, check: PlannedCheck, gathered: Gathered) -> None:
        self._check = check
        self._readings = gathered.readings()
        self._steps = spans(gathered.said)
        self.cut_short = self._cut_short(gathered)
        stops = 0 if check.plans.mount is None else len(check.plans.mount.joints)
        self.stops = self._numbers("mount", stops)
        self.waved = self._numbers("wave", len(check.setup.groups) if check.plans.wave else 0)
        read = self.read()
        self.cell_turned = read is not None and cell_is_turned(check.scene, check.setup, read)
        self.ports = self._swapped(gathered)
        self._readings = exchanged(self._readings, self.ports)
        self.serials = [ring.serial for ring in check.setup.rings]
        for port, c in enumerate(gathered.counts[: len(self.serials)]):
            ring = self.ports.get(port, port)
            if len(c.serials) == 1 and ring < len(self.serials):
                self.serials[ring] = next(iter(c.serials))

    def grids(self) -> dict[int, tuple[int, int]]:
        """Return the numbers of zones in the frames and as proposed, where they differ."""
        readings, setup, found = self._readings, self._check.setup, dict[int, tuple[int, int]]()
        if readings.zone_status is None:
            return found
        for i, group in enumerate(setup.groups):
            mine = readings.zone_status[readings.ring == i]
            count = int((mine != ABSENT).sum(axis=1).max(initial=0))
            wanted = math.prod(zone_grid(group.sensor))
            if count not in (0, wanted):
                found[i] = (count, wanted)
        return found

    def _swapped(self, gathered: Gathered) -> Ports:
        """Return the ports that belong to other rings: by what their lines say, else by a hand,
        else by what the sensors read at the stops.
        """
        scene, setup = self._check.scene, self._check.setup
        waves = {ring: self._of("wave", ring) for ring in self.waved}
        found = by_lines(setup, gathered.counts) or by_waving(waves, setup)
        if found or (all(c.serials for c in gathered.counts if c.frames) and _named(setup)):
            return found
        read = self.read()
        return {} if read is None or self.cell_turned else by_pattern(scene, setup, read)

    def _cut_short(self, gathered: Gathered) -> float | None:
        """Let a self check that was cut off end with its last reading; return its duration, s."""
        begin, now = unfinished(gathered.said, "self"), self._readings.time
        if begin is None or not (now >= begin).any():
            return None
        self._steps.append(Span("self", 0, begin, float(now.max())))
        return float(now.max()) - begin

    def _numbers(self, what: str, count: int) -> list[int]:
        """Return the numbers below ``count`` of the completed steps ``what``."""
        return sorted({s.number for s in self._steps if s.what == what and 0 <= s.number < count})

    def _of(self, what: str, number: int | None = None) -> Readings:
        """Return the readings of steps; for a repeated step, those of the last run."""
        last: dict[int, Span] = {
            s.number: s for s in self._steps if s.what == what and number in (None, s.number)
        }
        at, some = self._readings.time, np.zeros(len(self._readings), bool)
        for step in last.values():
            some |= (at >= step.begin) & (at <= step.end)
        return self._readings.only(some)

    def self_check(self) -> SelfCheck:
        return self_check(self._check.scene, self._check.setup, self._of("self"))

    def doubt(self) -> Doubt | None:
        """Return the doubtful readings of the part in which a sensor has the most."""
        found, scene, setup = None, self._check.scene, self._check.setup
        plans = self._check.plans
        steps = ["self"] * (plans.seconds is not None) + ["before"] * bool(plans.rods)
        parts = [self._stood(what) for what in steps]
        parts += [self._stops()] * (plans.mount is not None)
        for readings, joints in filter(None, parts):
            each = doubt(scene, setup, readings, joints)
            found = each if found is None else found.worse(each)
        return found

    def _stood(self, what: str) -> tuple[Readings, Float[np.ndarray, "P J"]] | None:
        """Return the readings of the steps ``what``, and the pose at each of them."""
        numbers = sorted({s.number for s in self._steps if s.what == what})
        each = [some for n in numbers if len(some := self._of(what, n))]
        if not each:
            return None
        return joined(each), np.array([np.median(some.joints, axis=0) for some in each])

    def frozen(self) -> list[str]:
        """Name the sensors of which too many zones read the same at the stops and poses."""
        parts = [some for some in (self._stops(), self._stood("before")) if some is not None]
        if not parts:
            return []
        readings = joined([some for some, _ in parts])
        share = frozen_zones(readings, self._check.setup, np.concatenate([q for _, q in parts]))
        which = np.flatnonzero(share > self._check.scene.motion.failed_share)
        names = sensor_names(self._check.setup, which)
        return [f"{name} ({100 * share[k]:.0f} %)" for name, k in zip(names, which, strict=True)]

    def waving(self, ring: int) -> Waving:
        return waved(self._of("wave", ring), self._check.setup, ring)

    def _stops(self) -> tuple[Readings, Float[np.ndarray, "P J"]] | None:
        """Return the readings at the stops that were read, and these stops."""
        plan = self._check.plans.mount
        if plan is None or not self.stops:
            return None
        return joined([self._of("mount", n) for n in self.stops]), plan.joints[self.stops]

    def read(self) -> Stops | None:
        some = self._stops()
        return None if some is None else at_stops(some[0], self._check.setup, some[1])

    def built(self, read: Stops | None) -> AsBuilt:
        some = self._stops()
        if read is None or some is None:
            raise ValueError("no stop has readings")
        scene, setup = self._check.scene, self._check.setup
        require_cell(scene)
        rings = tuple(replace(r, serial=self.serials[i]) for i, r in enumerate(setup.rings))
        setup = replace(setup, rings=rings)
        zones = {i: zones_at_stops(some[0], setup, i, some[1]) for i in zoned(setup)}
        zones = {i: stops for i, stops in zones.items() if stops.total.any()}
        fits = fit_mount(scene, setup, read, zones=zones)
        mute = (read.failed == read.total).all(axis=0)[setup.sensors - len(setup.singles) :]
        return AsBuilt(scene, setup, fits, tuple(int(k) for k in np.flatnonzero(mute)))

    def rods(self) -> list[RodCheck]:
        done, first, checks = {s.number for s in self._steps if s.what == "trial"}, 0, []
        if not done:
            raise ValueError("no trial was completed")
        for plan in self._check.plans.rods:
            numbers = range(first, first := first + len(plan.trials))
            trials = [self._of("trial", i) if i in done else None for i in numbers]
            checks.append(check_rod(plan, self._check.setup, self._of("before"), trials))
        return checks


def _named(setup: Setup) -> bool:
    """Whether the board of every ring is known."""
    return all(ring.serial for ring in setup.rings)
