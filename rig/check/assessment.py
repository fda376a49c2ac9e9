"""What was gathered, judged: while it is fresh or from a recording, by the same words."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from ...objectives.verify import Verifier
from ..mount.as_built import AsBuilt
from ..mount.fit import fit_mount
from ..mount.waving import Waving, waved
from ..rod.coverage_estimate import RodCheck, check_rod
from ..sensing.readings import Readings, Stops, at_stops, joined
from ..session.gathering import Gathered
from .findings import differences, missing
from .models import CheckResult
from .planned_check import PlannedCheck
from .procedure import Span, spans
from .records import (
    coverage_of,
    events_of,
    lines_of,
    link_of,
    looks_of,
    mount_of,
    seconds_of,
    warnings_of,
)
from .self_check import SelfCheck, self_check

_Found = TypeVar("_Found")


@dataclass(frozen=True)
class Assessment:
    """result; and, of the parts that were done, what it is made of. stops: numbers of the stops
    that were read. rods: a check of each target."""

    result: CheckResult
    looks: SelfCheck | None = None
    stops: Sequence[int] = ()
    read: Stops | None = None
    built: AsBuilt | None = None
    rods: Sequence[RodCheck] = ()
    verifier: Verifier | None = None


def assess(check: PlannedCheck, gathered: Gathered, wall: float, damage: str = "") -> Assessment:
    """The verdict.

    Args:
        check: what was to be done.
        gathered: what came.
        wall: s since 1970, when it was recorded.
        damage: of the recording, if it was read from one that is not whole.
    """
    readings, steps = Readings(*gathered.rows(len(check.setup.rings))), spans(gathered.said)
    done, warnings, reasons = (
        _Parts(check, readings, steps),
        warnings_of(gathered, damage),
        list[str](),
    )

    def part(name: str, work: Callable[[], _Found | None]) -> _Found | None:
        try:
            return work()
        except ValueError as error:
            reasons.append(f"{name}: {error}")
            return None

    plans, setup = check.plans, check.setup
    looks = part("self check", done.looks) if plans.seconds is not None else None
    waves = {
        i: w
        for i in done.waved
        if (w := part("self check", lambda i=i: done.waving(i))) is not None
    }
    read = done.stops() if plans.mount is not None else None
    built = part("mount check", lambda: done.built(read)) if plans.mount is not None else None
    rods = (part("coverage check", done.rods) or []) if plans.rods else []
    ended = next(
        (str(said.get("why")) for _, said in gathered.said if said.get("what") == "ended"),
        "it was cut off",
    )
    if ended:
        reasons.insert(0, f"ended early: {ended}")
    verifier = Verifier(check.scene, check.about.voxel)
    mount = mount_of(check, len(done.numbers), built, verifier)
    coverage = [coverage_of(check, rod, built) for rod in rods]
    differs = differences(looks, waves, mount, coverage, built)
    lacks, too_much = missing(
        plans, looks, waves, len(setup.rings), mount, len(done.numbers), coverage
    )
    reasons += differs + lacks
    result = CheckResult(
        setup=check.about.setup,
        simulated=check.about.injected,
        seed=check.about.seed,
        recorded=time.strftime("%Y-%m-%d %H:%M:%S UTC", time.gmtime(wall)),
        seconds=seconds_of(gathered),
        verdict="unfinished" if ended or too_much else "differs" if differs else "as proposed",
        reasons=reasons,
        warnings=warnings,
        robot=link_of(gathered),
        lines=lines_of(setup, check.ports, gathered),
        events=events_of(gathered),
        self_check=looks_of(looks, waves),
        mount=mount,
        coverage=coverage,
        version=check.about.version,
    )
    return Assessment(result, looks, done.numbers, read, built, rods, verifier)


class _Parts:
    """The parts, from readings and steps."""

    def __init__(self, check: PlannedCheck, readings: Readings, steps: Sequence[Span]) -> None:
        self._check, self._readings, self._steps = check, readings, steps
        plan, rings = check.plans.mount, len(check.setup.rings)
        most = {
            "mount": 0 if plan is None else len(plan.joints),
            "wave": rings if check.plans.wave else 0,
        }
        self.numbers, self.waved = (
            sorted({s.number for s in steps if s.what == what and 0 <= s.number < n})
            for what, n in most.items()
        )

    def _of(self, what: str, number: int | None = None) -> Readings:
        """The readings of steps; of the last one where it was done again."""
        time_, some = self._readings.time, np.zeros(len(self._readings), bool)
        for step in {
            s.number: s for s in self._steps if s.what == what and number in (None, s.number)
        }.values():
            some |= (time_ >= step.begin) & (time_ <= step.end)
        return self._readings.only(some)

    def looks(self) -> SelfCheck:
        return self_check(self._check.scene, self._check.setup, self._of("self"))

    def waving(self, ring: int) -> Waving:
        return waved(self._of("wave", ring), self._check.setup, ring)

    def stops(self) -> Stops | None:
        plan = self._check.plans.mount
        if plan is None or not self.numbers:
            return None
        parts = [self._of("mount", n) for n in self.numbers]
        return at_stops(joined(parts), self._check.setup, plan.joints[self.numbers])

    def built(self, read: Stops | None) -> AsBuilt:
        if read is None:
            raise ValueError("no stop was read")
        fits = fit_mount(self._check.scene, self._check.setup, read)
        return AsBuilt(self._check.scene, self._check.setup, fits)

    def rods(self) -> list[RodCheck]:
        done, first, found = (
            {s.number for s in self._steps if s.what == "trial"},
            0,
            list[RodCheck](),
        )
        if not done:
            raise ValueError("no trial was done")
        for plan in self._check.plans.rods:
            numbers = range(first, first := first + len(plan.stratum))
            trials = [self._of("trial", i) if i in done else None for i in numbers]
            found.append(check_rod(plan, self._check.setup, self._of("before"), trials))
        return found
