"""Results of the parts of a check, from the readings of their steps."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TypeVar

import numpy as np
from jaxtyping import Float

from ...simulation.twin.zone_grid import zone_grid, zoned
from ..mount.as_built import AsBuilt
from ..mount.cell_frame import cell_is_turned
from ..mount.fit import fit_mount
from ..mount.hand_sweep import Waving, waved
from ..mount.stop_plan import require_cell
from ..rod.coverage_estimate import RodCheck, check_rod
from ..sensing.readings import ABSENT, Readings, Stops, at_stops, joined, zones_at_stops
from ..sensing.zone_state import frozen_zones
from ..session.gathering import Gathered
from .doubt import Doubt, doubt
from .models import TimingModel
from .planned_check import PlannedCheck
from .port_matching import Ports, by_lines, by_pattern, by_waving, exchanged
from .procedure import Span, skipped, spans, unfinished
from .self_check import SelfCheck, self_check, sensor_names
from .timing_check import RingFrames, timing_check

_Result = TypeVar("_Result")
_Stood = tuple[Readings, Float[np.ndarray, "P J"]]
"""Readings of a robot that stood still, and the poses (P, J) rad at which it did."""


class PartResults:
    """Results of the parts that ran; None, or empty, for one that did not."""

    def __init__(self, check: PlannedCheck, gathered: Gathered) -> None:
        plans = check.plans
        self.check, self._readings, self._steps = check, gathered.readings(), spans(gathered.said)
        self.failures = list[str]()
        """Why a part has no result, one line each."""
        self.skipped_stops: Mapping[int, str] = skipped(gathered.said, "mount")
        """Why stops were skipped, by their numbers."""
        self.skipped_poses: Mapping[int, str] = skipped(gathered.said, "pose")
        """Why poses of the coverage check were skipped, by their numbers."""
        self.cut_short = self._cut_short(gathered)
        """Duration of a self check that was cut off, s; None if it was completed, or never began.
        """
        self.stops = self._numbers("mount", len(plans.mount.stops) if plans.mount else 0)
        """Numbers of the stops with readings."""
        hands = self._numbers("wave", len(check.setup.groups) if plans.wave else 0)
        read = self._read()
        self.cell_turned = read is not None and cell_is_turned(check.scene, check.setup, read)
        """Whether the readings at the stops fit the cell turned by 180° about z; then no mounting
        is estimated."""
        self.ports = self._swapped(gathered, hands, read)
        """Ports that belong to other rings than those they were given for."""
        self._readings = exchanged(self._readings, self.ports)
        self.grids = self._grids()
        """Numbers of zones of each sensor, in the frames and as proposed, of rings where they
        differ."""
        self.frozen = self._frozen()
        """Sensors of which too many zones read the same distance at all poses, and how many."""
        self.doubt = self._doubt()
        """Doubtful readings of each sensor while the robot stood still; None without a part in
        which it did."""
        self.self_check: SelfCheck | None = None
        """Result of the self check."""
        if plans.seconds is not None:
            self.self_check = self._part("self check", self._self_check)
        self.timing = self._timing(gathered)
        """What each ring keeps of the firing schedule; empty without one."""
        waves = {ring: self._part("self check", partial(self._waving, ring)) for ring in hands}
        self.waves = {ring: wave for ring, wave in waves.items() if wave is not None}
        """Result of waving for each ring number that a hand passed over."""
        self.read = self._read()
        """Readings at the stops."""
        self.built: AsBuilt | None = None
        """The rings as built, estimated from these readings."""
        if plans.mount is not None and not self.cell_turned:
            self.built = self._part("mount check", lambda: self._built(gathered))
        self.rods: Sequence[RodCheck] = ()
        """Result of the rod trials in each target."""
        if plans.rods:
            self.rods = self._part("coverage check", self._rods) or ()

    def _part(self, name: str, work: Callable[[], _Result]) -> _Result | None:
        """Return the result of a part; None, with the reason, if its readings give none."""
        try:
            return work()
        except ValueError as error:
            self.failures.append(f"{name}: {error}")
            return None

    def _grids(self) -> dict[int, tuple[int, int]]:
        readings, grids = self._readings, dict[int, tuple[int, int]]()
        if readings.zone_status is None:
            return grids
        for i, group in enumerate(self.check.setup.groups):
            mine = readings.zone_status[readings.ring == i]
            count = int((mine != ABSENT).sum(axis=1).max(initial=0))
            wanted = math.prod(zone_grid(group.sensor))
            if count not in (0, wanted):
                grids[i] = (count, wanted)
        return grids

    def _swapped(self, gathered: Gathered, hands: Sequence[int], read: Stops | None) -> Ports:
        """Return the ports that belong to other rings: by what their lines say, else by a hand,
        else by what the sensors read at the stops.
        """
        scene, setup = self.check.scene, self.check.setup
        waves = {ring: self._of("wave", ring) for ring in hands}
        ports = by_lines(setup, gathered.counts) or by_waving(waves, setup)
        named = all(ring.serial for ring in setup.rings)
        if ports or (named and all(c.serials for c in gathered.counts if c.frames)):
            return ports
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
        at, within = self._readings.time, np.zeros(len(self._readings), bool)
        for step in last.values():
            within |= (at >= step.begin) & (at <= step.end)
        return self._readings.only(within)

    def _self_check(self) -> SelfCheck:
        return self_check(self.check.scene, self.check.setup, self._of("self"))

    def _timing(self, gathered: Gathered) -> list[TimingModel]:
        """Compare the frames of the self check with the firing schedule."""
        steps = [step for step in self._steps if step.what == "self"][-1:]
        if not self.check.paces or not steps:
            return []
        times = gathered.times()
        during = np.flatnonzero((times >= steps[0].begin) & (times <= steps[0].end))
        middle = (times[during].min(initial=np.inf) + times[during].max(initial=0.0)) / 2
        each: dict[int, list[int]] = {i: [] for i in range(len(self.check.paces))}
        for k in during:
            port = gathered.frames[k][0]
            each[self.ports.get(port, port)].append(int(k))
        rings = [
            RingFrames.of([gathered.frames[k][1] for k in some], times[some] - middle)
            for some in each.values()
        ]
        return timing_check(self.check.setup, self.check.paces, rings)

    def _doubt(self) -> Doubt | None:
        """Return the doubtful readings of the part in which a sensor has the most."""
        plans, worst = self.check.plans, None
        steps = ["self"] * (plans.seconds is not None) + ["before"] * bool(plans.rods)
        for part in (*map(self._stood, steps), self._at_stops()):
            if part is not None:
                doubtful = doubt(self.check.scene, self.check.setup, *part)
                worst = doubtful if worst is None else worst.worse(doubtful)
        return worst

    def _stood(self, what: str) -> _Stood | None:
        """Return the readings of the steps ``what``, and the pose at each of them."""
        numbers = sorted({s.number for s in self._steps if s.what == what})
        parts = [part for n in numbers if len(part := self._of(what, n))]
        if not parts:
            return None
        return joined(parts), np.array([np.median(part.joints, axis=0) for part in parts])

    def _frozen(self) -> list[str]:
        parts = [part for part in (self._at_stops(), self._stood("before")) if part is not None]
        if not parts:
            return []
        setup, poses = self.check.setup, np.concatenate([q for _, q in parts])
        share = frozen_zones(joined([readings for readings, _ in parts]), setup, poses)
        which = np.flatnonzero(share > self.check.scene.motion.failed_share)
        names = sensor_names(setup, which)
        return [f"{name} ({100 * share[k]:.0f} %)" for name, k in zip(names, which, strict=True)]

    def _waving(self, ring: int) -> Waving:
        return waved(self._of("wave", ring), self.check.setup, ring)

    def _at_stops(self) -> _Stood | None:
        """Return the readings at the stops that were read, and these stops."""
        plan = self.check.plans.mount
        if plan is None or not self.stops:
            return None
        return joined([self._of("mount", n) for n in self.stops]), plan.joints[self.stops]

    def _read(self) -> Stops | None:
        part = self._at_stops()
        return None if part is None else at_stops(part[0], self.check.setup, part[1])

    def _built(self, gathered: Gathered) -> AsBuilt:
        part, read, scene, setup = self._at_stops(), self.read, self.check.scene, self.check.setup
        if read is None or part is None:
            raise ValueError("no stop has readings")
        require_cell(scene)
        serials = [ring.serial for ring in setup.rings]
        for port, c in enumerate(gathered.counts[: len(serials)]):
            ring = self.ports.get(port, port)
            if len(c.serials) == 1 and ring < len(serials):
                serials[ring] = next(iter(c.serials))
        rings = zip(setup.rings, serials, strict=True)
        setup = replace(setup, rings=tuple(replace(r, serial=serial) for r, serial in rings))
        zones = {i: zones_at_stops(part[0], setup, i, part[1]) for i in zoned(setup)}
        zones = {i: stops for i, stops in zones.items() if stops.total.any()}
        fits = fit_mount(scene, setup, read, zones=zones)
        singles = np.flatnonzero(read.mute[setup.sensors - len(setup.singles) :])
        return AsBuilt(scene, setup, fits, tuple(singles.tolist()))

    def _rods(self) -> list[RodCheck]:
        done, first, checks = {s.number for s in self._steps if s.what == "trial"}, 0, []
        if not done:
            raise ValueError("no trial was completed")
        for plan in self.check.plans.rods:
            numbers = range(first, first := first + len(plan.trials))
            trials = [self._of("trial", i) if i in done else None for i in numbers]
            checks.append(check_rod(plan, self.check.setup, self._of("before"), trials))
        return checks
