"""Files of a check: page, JSON, CSV, and the setup as built."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...formats.writing import output_files, write_text
from ...reporting.pages import csv_text, escaped, html, table
from ..mount.fit_record import RingFitModel
from ..rod.coverage_edge import EDGE
from ..rod.coverage_estimate import RodCheck
from ..sensing.expected import expected
from ..sensing.readings import Stops
from .assessment import Assessment
from .models import CheckResult, WavingModel
from .pictures import write_pictures
from .planned_check import PlannedCheck

OPTIONAL = ("stops.csv", "trials.csv", "built.toml")
"""Names of the files that only some checks write."""


def write_files(check: PlannedCheck, assessment: Assessment, folder: Path) -> list[str]:
    """Write the report of a check; return the names of the files."""
    result, done = assessment.result, assessment.parts
    texts = {"check.json": result.model_dump_json(indent=2) + "\n"}
    if done.read is not None:
        texts["stops.csv"] = csv_text(_stops(check, done.stops, done.read))
    if done.rods:
        texts["trials.csv"] = csv_text(_trials(done.rods))
    if done.built is not None:
        name = f"{check.name}, as built"
        texts["built.toml"] = done.built.toml(name, assessment.verifier)
    names, old = ["check.json", "check.html"], (p.name for p in folder.glob("check-*.png"))
    with output_files(folder, *dict.fromkeys([*names, *texts, *old]), keep=True) as new:
        pictures = write_pictures(check, assessment, new)
        texts["check.html"] = html(page(result, pictures), new, f"Check of {result.setup}")
        for name, text in texts.items():
            write_text(new / name, text)
    return list(dict.fromkeys([*names, *texts, *pictures]))


_NEAR_EDGE = f"of these up to {100 * EDGE:g} cm from the edge of coverage"
_ONE_SIDE = (
    "All these places are on one side of the edge of coverage: the rod can stand nowhere on the"
    " other side, in the target and around it. A smaller rod (--rod-mm) may find places there."
)


def _number(value: float, digits: int = 4) -> Any:
    return round(float(value), digits) if np.isfinite(value) else ""


def _stops(check: PlannedCheck, numbers: Sequence[int], read: Stops) -> list[Mapping[str, Any]]:
    """One row for each sensor, as wired, at each stop: expected reading as proposed, and actual
    reading.
    """
    setup = check.setup
    wanted = expected(check.scene, setup, read.joints)
    return [
        {
            "stop": stop,
            "ring": ring,
            "sensor": sensor,
            "proposed_m": _number(wanted.distance[p, k]),
            "read_m": _number(read.distance[p, k]),
            "scatter_m": _number(read.spread[p, k]),
            "valid": int(read.valid[p, k]),
            "readings": int(read.total[p, k]),
        }
        for p, stop in enumerate(numbers)
        for k, (ring, sensor) in enumerate(setup.labels)
    ]


def _trials(rods: Sequence[RodCheck]) -> list[Mapping[str, Any]]:
    """One row for each trial, numbered consecutively over the targets."""
    rows = list[Mapping[str, Any]]()
    for rod in rods:
        plan = rod.plan
        rows += [
            {
                "trial": len(rows) + i,
                "target": plan.named,
                "pose": int(plan.pose[i]),
                **{f"{a}_m": _number(v) for a, v in zip("xyz", plan.point[i], strict=True)},
                "predicted_seen": int(plan.covered[i]),
                "near_edge": int(plan.edge[i]),
                "beyond_target": int(plan.beyond[i]),
                "tested": int(rod.tested[i]),
                "seen": int(rod.seen[i]) if rod.tested[i] else "",
                "told_by": int(rod.told[i].sum()) if rod.tested[i] else "",
            }
            for i in range(len(plan.trials))
        ]
    return rows


def page(r: CheckResult, pictures: Mapping[str, str]) -> str:
    """Return the report as Markdown, with pictures by the names of their files."""
    rings, readings, trials = (
        [f"![{escaped(pictures[name])}]({name})" + "\n" for name in pictures if part in name]
        for part in ("rings", "readings", "trials")
    )
    lines = [f"# Check of {escaped(r.setup)}: {r.verdict}", "", f"> {r.disclaimer}", ""]
    kind = f"a simulated rig, seed {r.seed}" if r.simulated else "a real rig"
    lines += [
        f"Recorded {r.recorded} on {kind}, {r.seconds:.0f} s, by place-rings {escaped(r.version)}.",
        "",
    ]
    lines += [f"- {escaped(reason)}" for reason in r.reasons] + [""] * bool(r.reasons)
    if r.warnings:
        lines += ["## Warnings", "", *(f"- {escaped(warning)}" for warning in r.warnings), ""]
    lines += [*(escaped(note) for note in calibration_notes(r)), ""] * bool(r.calibration)
    return "\n".join(
        [
            *(*lines, *rings, *_self(r), *_timing(r), *_doubtful(r), *_mount(r), *readings),
            *(*_coverage(r), *trials, *_links(r)),
        ]
    )


def calibration_notes(r: CheckResult) -> list[str]:
    """Return lines about what the arm's calibration changes; none without one."""
    if not r.calibration:
        return []
    effect = r.calibration[0]
    changes = ", ".join(f"{100 * e.nominal:.2f} %" for e in r.calibration)
    return [
        f"Calibrated kinematics ({effect.source}): they move a sensor by up to"
        f" {1000 * effect.largest_move:.2f} mm; with the model's, ζ as proposed would be {changes}."
    ]


def _self(r: CheckResult) -> list[str]:
    if r.self_check is None:
        return []
    columns = {"ring": "{0.ring}", "frames": "{0.frames}", "a second": "{0.rate_hz:.1f}"}
    columns |= {"gaps": "{0.gaps}", "sensors that answer": "{0.answering}"}
    columns |= {"scatter, mm": "{0.scatter_mm:.1f}"}
    named = (
        ("Never answer", r.self_check.silent),
        ("Scatter more than expected", r.self_check.noisy),
        ("Often miss their target", r.self_check.lossy),
        ("See the robot itself", r.self_check.on_robot),
        ("Differ from the expected reading", r.self_check.surprising),
    )
    return [
        *("## Self check", "", _table_of(r.self_check.rings, columns)),
        *(f"- {words}: {escaped(', '.join(sensors))}" for words, sensors in named if sensors),
        *(f"- ring {w.ring}, by a hand: {escaped(_wired(w))}" for w in r.self_check.waved),
        "",
    ]


def _timing(r: CheckResult) -> list[str]:
    """Compare the frames of each ring with its firing schedule."""
    if not r.timing:
        return []
    columns = {"ring": "{0.ring}", "cycle, ms": "{0.cycle_ms:.1f}"}
    columns |= {"frames a second": "{0.found_hz:.2f}", "by the schedule": "{0.wanted_hz:.2f}"}
    columns |= {"behind, ms": "{0.late_ms:.1f}", "the ring": "{0.reference}"}
    columns |= {"sensors seen in their slots": "{0.seen}", "elsewhere or seldom": "{0.named}"}
    return ["## Firing schedule", "", _table_of(r.timing, columns), ""]


def _wired(wave: WavingModel) -> str:
    """Describe the wiring found by waving a hand."""
    missed = [f"no hand was seen by {', '.join(map(str, wave.missed))}"] * bool(wave.missed)
    return "; ".join(wave.faults + missed) or "wired in order"


def _mount(r: CheckResult) -> list[str]:
    if r.mount is None:
        return []
    stops = f"{r.mount.stops} of {r.mount.planned} stops; margins are 95 %."
    heads = ("ring", "link", "verdict", "slip, mm", "tilt, °", "phase, °", "offset, mm", "readings")
    rings = [_ring(ring) for ring in r.mount.rings]
    lines = ["## Mount check", "", stops, "", table([*heads, "residuals"], rings)]
    lines += [f"- {escaped(line)}" for ring in r.mount.rings for line in ring.text]
    if r.mount.injected_found is not None:
        held = [one.region_holds for one in r.mount.rings]
        said = ", ".join(
            f"{what} {'found' if ok else 'NOT found'}"
            for what, ok in r.mount.injected_found.items()
        )
        wrong = [what for what, ok in r.mount.injected_found.items() if not ok]
        nothing = f"No error or fault was injected{'; reported all the same: ' * bool(wrong)}"
        faults = f"Injected faults: {said}" if r.faults == "random" else nothing + ", ".join(wrong)
        text = f"{faults}. The injected errors lie in the 95 % region of {sum(map(bool, held))} of"
        lines += ["", f"{text} {len(held)} rings (injected value after the slash)."]
    columns = {"ζ, %": "{0.named}", "as proposed": "{0.proposed_percent:.2f}"}
    columns |= {"as built": "{0.built_percent:.2f}"}
    columns |= {"as built, answering sensors only": "{0.alive_percent:.2f}"}
    return [*lines, "", _table_of(r.mount.zeta, columns)]


def _ring(ring: RingFitModel) -> list[str]:
    by = {e.name: e for e in ring.errors}
    cells = []
    for name in ("slip", "tilt", "phase", "offset"):
        e = by.get(name)
        was = "" if e is None or e.injected is None else f" / {e.injected:+.2f}"
        cells.append("–" if e is None else f"{e.value:+.2f} ± {e.margin:.2f}{was}")
    used = [str(ring.readings), f"{ring.scale:.2f}"] if ring.errors else ["–", "–"]
    return [str(ring.ring), escaped(ring.link), ring.verdict, *cells, *used]


def _coverage(r: CheckResult) -> list[str]:
    lines = ["## Coverage check", ""] if r.coverage else []
    for c in r.coverage:
        (a, b), (d, e) = c.table
        thick, long = c.rod_mm
        rows = [
            ("predicted seen", str(a), str(b), str(c.edge[0])),
            ("predicted unseen", str(d), str(e), str(c.edge[1])),
        ]
        verdict = "they agree" if c.agrees else "they do not agree"
        lines += [
            (
                f"{c.trials} of {c.planned} trials with a rod {thick:g} mm thick and {long:g} mm"
                f" long, in the {c.testable_percent:.0f} % of {c.named} where it can stand:"
                f" {a + b} predicted seen, {d + e} predicted unseen"
                f"{f', of these {c.beyond} beyond the target' * bool(c.beyond)}."
            ),
            *("", table(("trials", "seen", "not seen", _NEAR_EDGE), rows)),
            *[_ONE_SIDE, ""] * (not (a + b and d + e)),
            (
                f"The rod is seen in **{c.measured_percent:.1f} %** ({c.low_percent:.1f} to"
                f" {c.high_percent:.1f}) of {c.named}, predicted {c.predicted_percent:.1f} %:"
                f" {verdict}."
            ),
        ]
        if c.built_percent is not None:
            lines.append(f"Predicted for the setup as built: {c.built_percent:.1f} %.")
        if c.true_percent is not None:
            lines.append(f"True value of the simulated rig, counted: {c.true_percent:.1f} %.")
        lines.append("")
    return lines


def _table_of(records: Iterable[object], columns: Mapping[str, str]) -> str:
    """Return a table of records by the format of each column, such as ``{0.rate_hz:.1f}``; a cell
    without a value is empty.
    """

    def cell(form: str, record: object) -> str:
        try:
            return escaped(form.format(record))
        except TypeError:  # None has no decimals
            return ""

    return table([*columns], [[cell(form, r) for form in columns.values()] for r in records])


def _doubtful(r: CheckResult) -> list[str]:
    """List the doubtful sensors with their shares of doubtful readings."""
    doubtful = [sensor for sensor in r.sensors if sensor.doubtful]
    columns = {"sensor": "{0.sensor}", "readings": "{0.readings}"}
    columns |= {f"{kind}, %": f"{{0.{kind}_percent:.0f}}" for kind in ("failed", "missing")}
    columns |= {"below 5 cm, %": "{0.near_percent:.0f}"}
    columns |= {f"{kind}, %": f"{{0.{kind}_percent:.0f}}" for kind in ("apart", "absent")}
    return ["## Doubtful sensors", "", _table_of(doubtful, columns), ""] if doubtful else []


def _links(r: CheckResult) -> list[str]:
    """Describe the links to the rings and the robot, and their events."""
    columns = {"ring": "{0.ring} {0.link}", "port": "simulated" if r.simulated else "{0.port}"}
    columns |= {"decoder": "{0.decoder}", "board": "{0.board}"}
    columns |= {key: f"{{0.{key}}}" for key in ("frames", "lost", "late", "corrupt", "restarts")}
    columns |= {"clock, ppm": "{0.drift_ppm:.1f}", "jitter, ms": "{0.jitter_ms:.2f}"}
    drift, jitter = (
        "" if value is None else f"{value:.{digits}f}"
        for value, digits in ((r.robot.drift_ppm, 1), (r.robot.jitter_ms, 2))
    )
    clock = (
        f"The robot sent {r.robot.states} states in {r.robot.seconds:.1f} s; its clock is {drift}"
        f" ppm faster than the host's; states arrive with a jitter of {jitter} ms."
    )
    lines = ["## Links", "", _table_of(r.lines, columns), clock, ""]
    lines += [
        f"- ring {line.ring}: the first line outside its decoder's grammar: {escaped(line.foreign)}"
        for line in r.lines
        if line.foreign
    ]
    if r.events:
        columns = {"s": "{0.seconds:.2f}", "ring": "{0.ring}", "what": "{0.what}"}
        lines += ["## Events", "", _table_of(r.events, columns | {"detail": "{0.detail}"})]
    return lines
