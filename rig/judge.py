"""What was gathered, judged: while it is fresh or from a recording, by the same words."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from ..coverage.rings import Setup
from ..objectives.exact import Verifier
from ..objectives.scene import Scene
from ..placement.convert import scene_of, setup_of
from .as_built import AsBuilt
from .check_models import AboutFile, CheckResult, CoverageModel, MountCheckModel, ZetaModel
from .check_records import events_of, fit_of, lines_of, link_of, looks_of, seconds_of, warnings_of
from .gathering import Gathered
from .health import Port
from .injected import Injected, injected
from .mount_fit import fit_mount
from .mount_model import LIMITS, NAMES
from .plan_files import mount_plan_of, rod_plan_of
from .procedure import Plans, Span, spans
from .readings import Readings, Stops, at_stops, joined
from .rod_check import RodCheck, check_rod
from .rod_plan import Places, places, rod_zeta
from .self_check import SelfCheck, self_check

_Found = TypeVar("_Found")


@dataclass(frozen=True)
class Checked:
    """What a check is of, as its recording says it."""

    about: AboutFile
    scene: Scene
    setup: Setup
    plans: Plans

    @staticmethod
    def of(about: AboutFile) -> "Checked":
        """All of it."""
        scene = scene_of(about.proposal.scene)
        stops, trials = about.stops, about.trials
        plans = Plans(about.seconds, mount_plan_of(stops) if stops else None, rod_plan_of(trials) if trials else None)
        return Checked(about, scene, setup_of(about.proposal.rings, scene.sensor, scene.ring_radius), plans)

    @property
    def ports(self) -> list[Port]:
        """Where the rings were."""
        return [Port(p.name, p.count, p.decoder, p.baud, p.patience) for p in self.about.ports]

    @property
    def injected(self) -> Injected | None:
        """What was done to a simulated rig."""
        return injected(self.scene, self.setup, self.about.seed) if self.about.injected else None


@dataclass(frozen=True)
class Judged:
    """result; and, of the parts that were done, what it is made of. stops: numbers of the stops that were read."""

    result: CheckResult
    looks: SelfCheck | None = None
    stops: Sequence[int] = ()
    read: Stops | None = None
    built: AsBuilt | None = None
    rod: RodCheck | None = None
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
    done, warnings, reasons = _Parts(checked, readings, steps), warnings_of(gathered, damage), list[str]()

    def part(name: str, work: Callable[[], _Found | None]) -> _Found | None:
        try:
            return work()
        except ValueError as error:
            reasons.append(f"{name}: {error}")
            return None

    looks = part("self check", done.looks) if checked.plans.seconds is not None else None
    read = done.stops() if checked.plans.mount is not None else None
    built = part("mount check", lambda: done.built(read)) if read is not None else None
    rod = part("coverage check", done.rod) if checked.plans.rod is not None else None
    ended = next((said["why"] for _, said in gathered.said if said.get("what") == "ended"), "it was cut off")
    if ended:
        reasons.insert(0, f"ended early: {ended}")
    verifier = Verifier(checked.scene, checked.about.voxel)
    mount = _mount(checked, done, read, built, verifier)
    coverage = _coverage(checked, rod, built)
    differs = _differences(looks, mount, coverage, built, reasons)
    missing = _missing(checked, looks, done, mount, coverage, reasons)
    result = CheckResult(
        setup=checked.about.setup,
        simulated=checked.about.injected,
        seed=checked.about.seed,
        recorded=time.strftime("%Y-%m-%d %H:%M:%S UTC", time.gmtime(wall)),
        seconds=seconds_of(gathered),
        verdict="unfinished" if ended or missing else "differs" if differs else "as proposed",
        reasons=reasons,
        warnings=warnings,
        robot=link_of(gathered),
        lines=lines_of(checked.setup, checked.ports, gathered),
        events=events_of(gathered),
        self_check=looks_of(looks),
        mount=mount,
        coverage=coverage,
        version=checked.about.version,
    )
    return Judged(result, looks, done.numbers, read, built, rod, verifier)


class _Parts:
    """The parts, from readings and steps."""

    def __init__(self, checked: Checked, readings: Readings, steps: Sequence[Span]) -> None:
        self._checked, self._readings, self._steps = checked, readings, steps
        self.numbers = sorted({s.number for s in steps if s.what == "mount"})

    def _of(self, what: str, number: int | None = None) -> Readings:
        """The readings of steps; of the last one where it was done again."""
        time_, some = self._readings.time, np.zeros(len(self._readings), bool)
        for step in {s.number: s for s in self._steps if s.what == what and number in (None, s.number)}.values():
            some |= (time_ >= step.begin) & (time_ <= step.end)
        return self._readings.only(some)

    def looks(self) -> SelfCheck:
        return self_check(self._checked.scene, self._checked.setup, self._of("self"))

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

    def rod(self) -> RodCheck:
        plan = self._checked.plans.rod
        assert plan is not None
        done = {s.number for s in self._steps if s.what == "trial"}
        if not done:
            raise ValueError("no trial was done")
        trials = [self._of("trial", i) if i in done else None for i in range(len(plan.stratum))]
        return check_rod(plan, self._checked.setup, self._of("before"), trials)


def _mount(
    checked: Checked, done: _Parts, read: Stops | None, built: AsBuilt | None, verifier: Verifier
) -> MountCheckModel | None:
    plan, was = checked.plans.mount, checked.injected
    if plan is None or read is None or built is None:
        return None
    zeta = []
    for goal in checked.scene.goals:
        z = built.zeta(goal.target, verifier)
        percents = {f"{key}_percent": 100 * getattr(z, key) for key in ("proposed", "built", "alive")}
        zeta.append(ZetaModel(target=goal.target.name, radius=goal.target.radius, **percents))
    return MountCheckModel(
        stops=len(done.numbers),
        planned=len(plan.joints),
        open=[f"ring {i}: {name}" for i, f in enumerate(built.fits) for name in f.open],
        rings=[fit_of(i, f, was) for i, f in enumerate(built.fits)],
        zeta=zeta,
        injected_found=None if was is None else was.found(built.fits),
    )


def _coverage(checked: Checked, rod: RodCheck | None, built: AsBuilt | None) -> CoverageModel | None:
    if rod is None:
        return None
    plan, was, true, guess = rod.plan, checked.injected, None, None
    if was is not None or built is not None:
        where: Places = places(checked.scene, plan.target, plan.rod)
        if built is not None:
            guess = 100 * rod_zeta(checked.scene, built.setup, where, plan.rod, plan.detection, built.alive)
        if was is not None:
            mounted = was.world(checked.scene).mounted
            true = 100 * rod_zeta(checked.scene, mounted, where, plan.rod, plan.detection, was.alive)
    size = [2000 * plan.rod.radius, 1000 * (plan.rod.length + 2 * plan.rod.radius)]
    return CoverageModel(
        target=plan.target.name,
        radius=plan.target.radius,
        rod_mm=[round(v, 3) for v in size],
        trials=int(rod.tested.sum()),
        planned=len(rod.tested),
        testable_percent=100 * plan.testable,
        table=rod.table.tolist(),
        predicted_percent=min(100 * rod.predicted, 100.0),
        built_percent=guess,
        true_percent=true,
        measured_percent=min(100 * rod.share.value, 100.0),
        low_percent=100 * rod.share.low,
        high_percent=min(100 * rod.share.high, 100.0),
        agrees=rod.agrees,
    )


def _differences(
    looks: SelfCheck | None,
    mount: MountCheckModel | None,
    coverage: CoverageModel | None,
    built: AsBuilt | None,
    reasons: list[str],
) -> bool:
    """Whether the rig is other than proposed; why, added to ``reasons``."""
    before = len(reasons)
    if looks is not None:
        if len(looks.silent):
            reasons.append(f"sensors that never answer: {', '.join(looks.named(looks.silent))}")
        if len(looks.noisy):
            reasons.append(f"sensors that scatter more than thought: {', '.join(looks.named(looks.noisy))}")
        if len(looks.surprising) and mount is None:
            reasons.append(f"sensors that read other than expected: {', '.join(looks.named(looks.surprising))}")
    if mount is not None and built is not None:
        reasons += [f"ring {r.ring} ({r.link}) {fault}" for r in mount.rings for fault in r.faults]
        for i, fit in enumerate(built.fits):
            limit = LIMITS[[NAMES.index(name) for name in fit.names]]
            beyond = np.abs(fit.values) > limit + fit.margins()
            reasons += [
                f"ring {i} ({fit.nominal.link}) is off by more than a careful mount: {fit.names[k]}"
                for k in np.flatnonzero(beyond)
            ]
    if coverage is not None and not coverage.agrees:
        found = f"{coverage.measured_percent:.1f} % ({coverage.low_percent:.1f} to {coverage.high_percent:.1f})"
        reasons.append(f"the rod was seen in {found} of the target, predicted: {coverage.predicted_percent:.1f} %")
    return len(reasons) > before


def _missing(
    checked: Checked,
    looks: SelfCheck | None,
    done: _Parts,
    mount: MountCheckModel | None,
    coverage: CoverageModel | None,
    reasons: list[str],
) -> bool:
    """Whether a part that was asked for cannot be judged, or only in part."""
    plans = checked.plans
    plan = plans.mount
    if plan is not None and len(done.numbers) < len(plan.joints):
        reasons.append(f"mount check: {len(done.numbers)} of {len(plan.joints)} stops were read")
    if coverage is not None and coverage.trials < coverage.planned:
        reasons.append(f"coverage check: {coverage.trials} of {coverage.planned} trials were done")
    nothing = (
        (plans.seconds is not None and looks is None)
        or (plan is not None and mount is None)
        or (plans.rod is not None and coverage is None)
    )
    few = plan is not None and 2 * len(done.numbers) < len(plan.joints)
    short = coverage is not None and 2 * coverage.trials < coverage.planned
    return nothing or few or short
