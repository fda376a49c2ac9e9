"""Convert collected data and results to the models of a check."""

from collections.abc import Mapping, Sequence

import numpy as np

from ...coverage.rings.ring import Setup
from ...objectives.verify import Verifier
from ..mount.as_built import AsBuilt
from ..mount.fit_record import fit_of
from ..mount.hand_sweep import Waving
from ..recording.clocks import Alignment
from ..rings.line_monitor import Happened, Port
from ..robot.vetting import Ended
from ..rod.coverage_estimate import RodCheck
from ..rod.trial_plan import Places, places, rod_zeta
from ..session.gathering import Gathered
from .doubt import KINDS, Doubt
from .line_findings import chip_of, code_findings, unknown_codes
from .models import (
    CoverageModel,
    EventModel,
    LineModel,
    LinkModel,
    MountCheckModel,
    SelfModel,
    SensorHealthModel,
    WavingModel,
)
from .planned_check import PlannedCheck
from .self_check import SelfCheck, sensor_names

_WORTH = (Happened.BACK,)  # events that are no warning
_STARTING = (Happened.SILENT.value, Happened.GARBLED.value)
# places away from the edge of coverage at which a sensor sees the rod although none should
_INTRUDES = 2


def seconds_of(gathered: Gathered) -> float:
    """Return the time from the robot's first state to its last, s."""
    times = [s.time for s in gathered.states] or [0.0]
    return round(times[-1] - times[0], 3)


def _clock(alignment: Alignment | None) -> dict[str, float]:
    """Return drift and jitter of a clock; none of an unknown one."""
    if alignment is None:
        return {}
    drift, jitter = round(1e6 * alignment.drift, 2), round(1000 * alignment.jitter, 3)
    return {"drift_ppm": drift, "jitter_ms": jitter}


def link_of(gathered: Gathered) -> LinkModel:
    """Describe the robot's link."""
    ended = None
    if endings := gathered.notes("link ended"):
        why, detail = (str(endings[0].get(key, "")) for key in ("why", "detail"))
        ended = ": ".join(
            t for t in (Ended[why].value if why in Ended.__members__ else why, detail) if t
        )
    states, seconds = gathered.state_count, seconds_of(gathered)
    return LinkModel(states=states, seconds=seconds, ended=ended, **_clock(gathered.clock()))


def lines_of(setup: Setup, ports: Sequence[Port], gathered: Gathered) -> list[LineModel]:
    """Describe every ring's line."""
    clocks = gathered.clocks(len(ports))
    return [
        LineModel(
            ring=i,
            link=ring.link,
            port=port.name,
            decoder=port.decoder,
            frames=c.frames,
            lost=c.lost,
            late=c.late,
            corrupt=c.corrupt,
            restarts=c.restarts,
            foreign=c.foreign or None,
            unknown_codes=unknown_codes(c),
            codes_of=chip_of(c),
            serial=next((s for s, _ in c.serials.most_common(1)), None),
            **_clock(clock),
        )
        for i, (ring, port, c, clock) in enumerate(
            zip(setup.groups, ports, gathered.counts, clocks, strict=True)
        )
    ]


def events_of(gathered: Gathered) -> list[EventModel]:
    """List the events of the rings' lines, in order of time."""
    start = min([s.time for s in gathered.states] + [e.time for e in gathered.events], default=0.0)
    events = sorted(gathered.events, key=lambda e: (e.time, e.ring, e.what.name))
    return [
        EventModel(
            seconds=round(e.time - start, 3), ring=e.ring, what=e.what.value, detail=e.detail
        )
        for e in events
    ]


def warnings_of(
    setup: Setup, gathered: Gathered, damage: str, lines: Sequence[LineModel]
) -> list[str]:
    """List reasons to distrust the result; ``lines`` are those of the rings."""
    waited = _waited_for(gathered)
    happened = [
        f"{setup.group_name(e.ring)}: {e.what}{': ' + e.detail if e.detail else ''}"
        for e in events_of(gathered)
        if e.what not in {w.value for w in _WORTH} and e not in waited
    ]
    link = link_of(gathered).ended
    waived = [note for note in gathered.notes("near stop") if note.get("waived") is True]
    shares = [note["share"] for note in waived if isinstance(note.get("share"), float)]
    foreign = [
        f"{setup.group_name(line.ring)}: {line.corrupt} lines are corrupt, the first foreign one:"
        f" {line.foreign}"
        for line in lines
        if line.foreign
    ]
    return [
        *(
            f"the robot moved while {100 * share:.0f} % of the sensors kept the full near stop"
            " (--allow-reduced-near-stop)"
            for share in shares
        ),
        *([f"the robot's link ended: {link}"] if link else []),
        *(str(note.get("text")) for note in gathered.notes("warning")),
        *([f"the recording is damaged: {damage}"] if damage else []),
        *code_findings(setup, lines)[1],
        *foreign,
        *dict.fromkeys(happened),
    ]


def _waited_for(gathered: Gathered) -> list[EventModel]:
    """Return the silence of rings that were starting, before their first frames."""
    stated = [note.get("rings") for note in gathered.notes("starting")]
    rings = {
        ring for part in stated if isinstance(part, list) for ring in part if isinstance(ring, int)
    }
    waited, begun = list[EventModel](), set[int]()
    for event in events_of(gathered):
        if event.what == Happened.BACK.value:
            begun.add(event.ring)
        elif event.ring in rings - begun and event.what in _STARTING:
            waited.append(event)
    return [event for event in waited if event.ring in begun]


def self_check_of(done: SelfCheck | None, waved: Mapping[int, Waving]) -> SelfModel | None:
    """Describe the self check."""
    if done is None:
        return None
    keys = ("silent", "noisy", "lossy", "on_robot", "surprising")
    hands = [
        WavingModel(
            ring=i,
            seats=[None if seat < 0 else seat for seat in wave.seat.tolist()],
            faults=wave.faults(),
            missed=list(wave.missed),
        )
        for i, wave in waved.items()
    ]
    return SelfModel(
        rings=list(done.rings),
        waved=hands,
        silent_zones=done.silent_zones,
        blocked_zones=done.blocked_zones,
        **{key: done.named(getattr(done, key)) for key in keys},
    )


def sensors_of(setup: Setup, doubtful: Doubt | None) -> list[SensorHealthModel]:
    """Describe the doubtful readings of each sensor."""
    if doubtful is None:
        return []
    names = sensor_names(setup, np.arange(setup.sensors))
    readings_of, found = doubtful.readings.tolist(), np.any(doubtful.found, axis=0).tolist()
    rows = zip(
        names, readings_of, found, np.round(100 * doubtful.shares.T, 3).tolist(), strict=True
    )
    return [
        SensorHealthModel(
            sensor=name,
            readings=readings,
            doubtful=doubtful,
            **{f"{kind}_percent": share for kind, share in zip(KINDS, shares, strict=True)},
        )
        for name, readings, doubtful, shares in rows
    ]


def mount_of(
    check: PlannedCheck, stops: int, built: AsBuilt | None, verifier: Verifier
) -> MountCheckModel | None:
    """Describe a mount check with readings at ``stops`` stops."""
    plan, was = check.plans.mount, check.injected
    if plan is None or built is None:
        return None
    return MountCheckModel(
        stops=stops,
        planned=len(plan.joints),
        rings=[
            fit_of(i, f, None if was is None else was.errors[i]) for i, f in enumerate(built.fits)
        ],
        zeta=[built.zeta(goal.target, verifier) for goal in check.scene.targets],
        injected_found=None if was is None else was.found(built.fits),
    )


def coverage_of(check: PlannedCheck, rod: RodCheck, built: AsBuilt | None) -> CoverageModel:
    """Describe the trials in a target."""
    plan, was, scene, true, guess = rod.plan, check.injected, check.scene, None, None
    if was is not None or built is not None:
        target = scene.target_named(plan.target, plan.target_radius)
        place: Places = places(scene, target, plan.rod)
        rule = (place, plan.rod, plan.detection)
        if built is not None:
            guess = 100 * rod_zeta(scene, built.setup, *rule, built.alive)
        if was is not None:
            true = 100 * rod_zeta(scene, was.world(scene).mounted, *rule, was.alive)
    size = [2000 * plan.rod.radius, 1000 * (plan.rod.length + 2 * plan.rod.radius)]
    edge = [int((rod.tested & plan.edge & (plan.covered == c)).sum()) for c in (True, False)]
    return CoverageModel(
        target=plan.target,
        radius=plan.target_radius,
        rod_mm=[round(v, 3) for v in size],
        trials=int(rod.tested.sum()),
        planned=len(rod.tested),
        testable_percent=100 * plan.testable,
        table=rod.table.tolist(),
        edge=edge,
        beyond=int((rod.tested & plan.beyond).sum()),
        contradicted=_contradicted(check.setup, rod),
        predicted_percent=min(100 * rod.predicted, 100.0),
        built_percent=guess,
        true_percent=true,
        measured_percent=min(100 * rod.share.value, 100.0),
        low_percent=100 * rod.share.low,
        high_percent=min(100 * rod.share.high, 100.0),
        agrees=rod.agrees,
    )


def _contradicted(setup: Setup, rod: RodCheck) -> list[str]:
    """Say on which side of the edge of coverage the trials contradict the prediction."""
    (_, missed), (intruded, _) = rod.table
    (covered, uncovered), said = rod.table.sum(axis=1), list[str]()
    if rod.contradicted(True):
        said.append(f"the rod was not seen at {missed} of {covered} places where it should be")
    every, inner = rod.intruding
    which = np.flatnonzero(every if rod.contradicted(False) else inner >= _INTRUDES)
    if len(which):
        by = zip(sensor_names(setup, which), every[which], strict=True)
        said.append(
            f"the rod was seen at {intruded} of {uncovered} places where no sensor should see it:"
            f" by {', '.join(f'{name} ({count})' for name, count in by)}"
        )
    return said
