"""What was gathered, judged: while it is fresh or from a recording, by the same words."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np

from ..objectives.verify import Verifier
from .check_models import CheckResult
from .check_records import (
    coverage_of,
    events_of,
    lines_of,
    link_of,
    looks_of,
    mount_of,
    seconds_of,
    warnings_of,
)
from .checked import Checked
from .listening.gathering import Gathered
from .mount.as_built import AsBuilt
from .mount.fit import fit_mount
from .mount.waving import Waving, waved
from .procedure import Span, spans
from .rod.check import RodCheck, check_rod
from .self_check import SelfCheck, self_check
from .sensing.readings import Readings, Stops, at_stops, joined
from .verdict import differences, missing

_Found = TypeVar("_Found")


@dataclass(frozen=True)
class Judged:
    """result; and, of the parts that were done, what it is made of. stops: numbers of the stops
    that were read. rods: a check of each target."""

    result: CheckResult
    looks: SelfCheck | None = None
    stops: Sequence[int] = ()
    read: Stops | None = None
    built: AsBuilt | None = None
    rods: Sequence[RodCheck] = ()
    verifier: Verifier | None = None


def judge(checked: Checked, gathered: Gathered, wall: float, damage: str = "") -> Judged:
    """The verdict.

    Args:
        checked: what was to be done.
        gathered: what came.
        wall: s since 1970, when it was recorded.
        damage: of the recording, if it was read from one that is not whole.
    """
    readings, steps = Readings(*gathered.rows(len(checked.setup.rings))), spans(gathered.said)
    done, warnings, reasons = (
        _Parts(checked, readings, steps),
        warnings_of(gathered, damage),
        list[str](),
    )

    def part(name: str, work: Callable[[], _Found | None]) -> _Found | None:
        try:
            return work()
        except ValueError as error:
            reasons.append(f"{name}: {error}")
            return None

    plans, setup = checked.plans, checked.setup
    looks = part("self check", done.looks) if plans.seconds is not None else None
    waves = {
        i: w for i in done.waved if (w := part("self check", partial(done.waving, i))) is not None
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
    verifier = Verifier(checked.scene, checked.about.voxel)
    mount = mount_of(checked, len(done.numbers), built, verifier)
    coverage = [coverage_of(checked, rod, built) for rod in rods]
    differs = differences(looks, waves, mount, coverage, built)
    lacks, too_much = missing(
        plans, looks, waves, len(setup.rings), mount, len(done.numbers), coverage
    )
    reasons += differs + lacks
    result = CheckResult(
        setup=checked.about.setup,
        simulated=checked.about.injected,
        seed=checked.about.seed,
        recorded=time.strftime("%Y-%m-%d %H:%M:%S UTC", time.gmtime(wall)),
        seconds=seconds_of(gathered),
        verdict="unfinished" if ended or too_much else "differs" if differs else "as proposed",
        reasons=reasons,
        warnings=warnings,
        robot=link_of(gathered),
        lines=lines_of(setup, checked.ports, gathered),
        events=events_of(gathered),
        self_check=looks_of(looks, waves),
        mount=mount,
        coverage=coverage,
        version=checked.about.version,
    )
    return Judged(result, looks, done.numbers, read, built, rods, verifier)


class _Parts:
    """The parts, from readings and steps."""

    def __init__(self, checked: Checked, readings: Readings, steps: Sequence[Span]) -> None:
        self._checked, self._readings, self._steps = checked, readings, steps
        plan, rings = checked.plans.mount, len(checked.setup.rings)
        most = {
            "mount": 0 if plan is None else len(plan.joints),
            "wave": rings if checked.plans.wave else 0,
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
        return self_check(self._checked.scene, self._checked.setup, self._of("self"))

    def waving(self, ring: int) -> Waving:
        return waved(self._of("wave", ring), self._checked.setup, ring)

    def stops(self) -> Stops | None:
        plan = self._checked.plans.mount
        if plan is None or not self.numbers:
            return None
        parts = [self._of("mount", n) for n in self.numbers]
        return at_stops(joined(parts), self._checked.setup, plan.joints[self.numbers])

    def built(self, read: Stops | None) -> AsBuilt:
        if read is None:
            raise ValueError("no stop was read")
        fits = fit_mount(self._checked.scene, self._checked.setup, read)
        return AsBuilt(self._checked.scene, self._checked.setup, fits)

    def rods(self) -> list[RodCheck]:
        done, first, found = (
            {s.number for s in self._steps if s.what == "trial"},
            0,
            list[RodCheck](),
        )
        if not done:
            raise ValueError("no trial was done")
        for plan in self._checked.plans.rods:
            numbers = range(first, first := first + len(plan.stratum))
            trials = [self._of("trial", i) if i in done else None for i in numbers]
            found.append(check_rod(plan, self._checked.setup, self._of("before"), trials))
        return found
