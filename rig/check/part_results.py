"""Results of the parts of a check, from the readings of their steps."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TypeVar

import numpy as np

from ..mount.as_built import AsBuilt
from ..mount.fit import fit_mount
from ..mount.hand_sweep import Waving, waved
from ..rod.coverage_estimate import RodCheck, check_rod
from ..sensing.readings import Readings, Stops, at_stops, joined
from ..session.gathering import Gathered
from .planned_check import PlannedCheck
from .procedure import Span, spans
from .self_check import SelfCheck, self_check

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
    read: Stops | None = None
    """Readings at these stops."""
    built: AsBuilt | None = None
    """The rings as built, estimated from these readings."""
    rods: Sequence[RodCheck] = ()
    """Result of the rod trials in each target."""
    failures: list[str] = field(default_factory=list)
    """Why a part has no result, one line each."""


def part_results(check: PlannedCheck, gathered: Gathered) -> PartResults:
    """Evaluate all parts of a check."""
    plans, parts = check.plans, _Parts(check, gathered)
    done = PartResults(stops=parts.stops)

    def part(name: str, work: Callable[[], _Result]) -> _Result | None:
        try:
            return work()
        except ValueError as error:
            done.failures.append(f"{name}: {error}")
            return None

    if plans.seconds is not None:
        done.self_check = part("self check", parts.self_check)
    for ring in parts.waved:
        wave = part("self check", partial(parts.waving, ring))
        if wave is not None:
            done.waves[ring] = wave
    if plans.mount is not None:
        done.read = parts.read()
        done.built = part("mount check", lambda: parts.built(done.read))
    if plans.rods:
        done.rods = part("coverage check", parts.rods) or []
    return done


class _Parts:
    """Evaluates each part from the readings of its steps."""

    def __init__(self, check: PlannedCheck, gathered: Gathered) -> None:
        self._check = check
        self._readings = Readings(*gathered.rows(len(check.setup.groups)))
        self._steps = spans(gathered.said)
        stops = 0 if check.plans.mount is None else len(check.plans.mount.joints)
        self.stops = self._numbers("mount", stops)
        self.waved = self._numbers("wave", len(check.setup.groups) if check.plans.wave else 0)

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

    def waving(self, ring: int) -> Waving:
        return waved(self._of("wave", ring), self._check.setup, ring)

    def read(self) -> Stops | None:
        plan = self._check.plans.mount
        if plan is None or not self.stops:
            return None
        readings = joined([self._of("mount", n) for n in self.stops])
        return at_stops(readings, self._check.setup, plan.joints[self.stops])

    def built(self, read: Stops | None) -> AsBuilt:
        if read is None:
            raise ValueError("no stop has readings")
        fits = fit_mount(self._check.scene, self._check.setup, read)
        setup = self._check.setup
        mute = (read.failed == read.total).all(axis=0)[setup.sensors - len(setup.singles) :]
        return AsBuilt(self._check.scene, setup, fits, tuple(int(k) for k in np.flatnonzero(mute)))

    def rods(self) -> list[RodCheck]:
        done, first, checks = {s.number for s in self._steps if s.what == "trial"}, 0, []
        if not done:
            raise ValueError("no trial was completed")
        for plan in self._check.plans.rods:
            numbers = range(first, first := first + len(plan.stratum))
            trials = [self._of("trial", i) if i in done else None for i in numbers]
            checks.append(check_rod(plan, self._check.setup, self._of("before"), trials))
        return checks
