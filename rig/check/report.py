"""Files of a check: page, JSON, CSV, and the setup as built."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...formats.writing import output_files, write_text
from ...reporting.pages import csv_text, escaped, html, table
from ..rod.coverage_edge import EDGE
from ..rod.coverage_estimate import RodCheck
from ..sensing.expected import expected
from ..sensing.readings import Stops
from .assessment import Assessment
from .health_tables import doubtful_sensors, links, shown_number
from .models import CheckResult, RingFitModel, WavingModel
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
        name = f"{check.about.setup}, as built"
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
                "target": str(plan.target),
                "pose": int(plan.pose[i]),
                **dict(
                    zip(("x_m", "y_m", "z_m"), (_number(v) for v in plan.point[i]), strict=True)
                ),
                "predicted_seen": int(plan.covered[i]),
                "near_edge": int(plan.edge[i]),
                "beyond_target": int(plan.beyond[i]),
                "tested": int(rod.tested[i]),
                "seen": int(rod.seen[i]) if rod.tested[i] else "",
                "told_by": int(rod.told[i].sum()) if rod.tested[i] else "",
            }
            for i in range(len(plan.stratum))
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
            *(*lines, *rings, *_self(r), *doubtful_sensors(r), *_mount(r), *readings),
            *(*_coverage(r), *trials, *links(r)),
        ]
    )


def calibration_notes(r: CheckResult) -> list[str]:
    """Return lines about what the arm's calibration changes; none without one."""
    if not r.calibration:
        return []
    one = r.calibration[0]
    changes = ", ".join(f"{100 * e.nominal:.2f} %" for e in r.calibration)
    return [
        f"Calibrated kinematics ({one.source}): they move a sensor by up to"
        f" {1000 * one.largest_move:.2f} mm; with the model's, ζ as proposed would be {changes}."
    ]


def _self(r: CheckResult) -> list[str]:
    if r.self_check is None:
        return []
    rows = [
        (
            str(one.ring),
            str(one.frames),
            f"{one.rate_hz:.1f}",
            str(one.gaps),
            str(one.answering),
            shown_number(one.scatter_mm),
        )
        for one in r.self_check.rings
    ]
    heads = ("ring", "frames", "a second", "gaps", "sensors that answer", "scatter, mm")
    named = (
        ("Never answer", r.self_check.silent),
        ("Scatter more than expected", r.self_check.noisy),
        ("Often miss their target", r.self_check.lossy),
        ("See the robot itself", r.self_check.on_robot),
        ("Differ from the expected reading", r.self_check.surprising),
    )
    return [
        *("## Self check", "", table(heads, rows)),
        *(f"- {words}: {escaped(', '.join(sensors))}" for words, sensors in named if sensors),
        *(f"- ring {w.ring}, by a hand: {escaped(_wired(w))}" for w in r.self_check.waved),
        "",
    ]


def _wired(wave: WavingModel) -> str:
    """Describe the wiring found by waving a hand."""
    missed = [f"no hand was seen by {', '.join(map(str, wave.missed))}"] * bool(wave.missed)
    return "; ".join(wave.faults + missed) or "wired in order"


def _mount(r: CheckResult) -> list[str]:
    if r.mount is None:
        return []
    lines = [
        "## Mount check",
        "",
        f"{r.mount.stops} of {r.mount.planned} stops; margins are 95 %.",
        "",
    ]
    heads = [
        "ring",
        "link",
        "verdict",
        "slip, mm",
        "tilt, °",
        "phase, °",
        "offset, mm",
        "readings",
        "residuals",
    ]
    lines += [table(heads, [_ring(one) for one in r.mount.rings])]
    lines += [
        f"- ring {one.ring} ({escaped(one.link)}): {escaped(fault)}"
        for one in r.mount.rings
        for fault in (*one.faults, *one.open)
    ]
    if r.mount.injected_found is not None:
        held = [one.region_holds for one in r.mount.rings]
        said = ", ".join(
            f"{what} {'found' if ok else 'NOT found'}"
            for what, ok in r.mount.injected_found.items()
        )
        wrong = [what for what, ok in r.mount.injected_found.items() if not ok]
        nothing = f"No error or fault was injected{'; reported all the same: ' * bool(wrong)}"
        faults = f"Injected faults: {said}" if r.faults == "random" else nothing + ", ".join(wrong)
        lines += [
            "",
            (
                f"{faults}. The injected errors lie in the 95 % region of"
                f" {sum(map(bool, held))} of {len(held)} rings (injected value after the slash)."
            ),
        ]
    rows = [
        (
            z.named,
            *(f"{v:.2f}" for v in (z.proposed_percent, z.built_percent, z.alive_percent)),
        )
        for z in r.mount.zeta
    ]
    return [
        *lines,
        "",
        table(("ζ, %", "as proposed", "as built", "as built, answering sensors only"), rows),
    ]


def _ring(one: RingFitModel) -> list[str]:
    by = {e.name: e for e in one.errors}
    cells = []
    for name in ("slip", "tilt", "phase", "offset"):
        e = by.get(name)
        was = "" if e is None or e.injected is None else f" / {e.injected:+.2f}"
        cells.append("–" if e is None else f"{e.value:+.2f} ± {e.margin:.2f}{was}")
    used = [str(one.readings), f"{one.scale:.2f}"] if one.errors else ["–", "–"]
    return [str(one.ring), escaped(one.link), one.verdict, *cells, *used]


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
