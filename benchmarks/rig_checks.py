"""Checks of a simulated rig: recovery of injected mounting errors and faults, and of coverage.

Each run mounts five rings of 16 sensors on a UR10 in a cell of floor, table and box. Each ring is
off by up to 20 mm along its link, 5° of tilt and 5° of phase, and its readings are off by up to 20
mm. In one ring two sensors are swapped, one of all sensors is dead, and one ring is reversed: wired
in reverse, or mounted the other way round. Readings have noise of 5 mm and 1 % of the distance, are
rounded to 1 mm, and 2 % are lost. The mount check stops at 24 planned poses with 10 frames each.
The coverage check puts a rod at 120 points, at three poses, planned for the setup as proposed. The
true share of the coverage check is counted at every voxel of the target with the rings as mounted.
Only these errors distinguish the simulated rig from the model.
"""

import json
import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from common import table
from jaxtyping import Bool
from loads import Measured, code, loads, measured, processes_of, runs_of_options
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.solids.polyhedra import box, half_space
from place_rings.coverage.targets import Target
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Obstacle, paper_scene
from place_rings.rig.mount.as_built import AsBuilt, truth_of
from place_rings.rig.mount.fit import fit_mount
from place_rings.rig.mount.stop_plan import MountPlan, planned
from place_rings.rig.rod.coverage_estimate import RodCheck, check_rod
from place_rings.rig.rod.rod import Rod
from place_rings.rig.rod.trial_plan import Places, places, plan_rod, rod_zeta
from place_rings.rig.sensing.readings import at_stops
from place_rings.rig.simulated_cell.ground_truth import injected
from place_rings.rig.simulated_cell.world import World
from scipy import stats

RUNS = 200
TARGET = Target("V_S", 0.5)
SCENE = paper_scene(
    poses=tuple(
        Pose(np.radians(q))
        for q in (
            (0, -45, 60, -105, -90, 0),
            (40, -70, 90, -110, -90, 0),
            (-60, -60, 50, -80, -90, 0),
        )
    ),
    obstacles=(
        Obstacle("floor", half_space(-0.75)),
        Obstacle("table", box((0.9, 0.0, -0.2), (0.6, 1.2, 0.05))),
        Obstacle("box", box((-0.7, 0.5, -0.45), (0.4, 0.5, 0.6))),
    ),
)
SETUP = Setup(
    (
        Ring("upper_arm", 0.3, 16, 0.4, 0.0, 0.09),
        Ring("upper_arm", 0.7, 16, -0.4, 0.0, 0.09),
        Ring("forearm", 0.3, 16, 0.4, 0.0, 0.08),
        Ring("forearm", 0.7, 16, -0.4, 0.0, 0.08),
        Ring("tool", 0.0, 16, 0.0, 0.0, 0.08),
    )
)
# in the current folder: finished runs of the same code are not repeated
KEPT = Path("rig_checks.jsonl")


def one(seed: int, plan: MountPlan, where: Places) -> dict[str, Any]:
    """Run the checks once and return the results as plain values."""
    rng, done = np.random.default_rng((seed, 8)), injected(SCENE, SETUP, seed)
    world = done.world(SCENE)
    stops = at_stops(world.readings(rng, plan.joints, plan.frames), SETUP, plan.joints)
    fits = fit_mount(SCENE, SETUP, stops)
    truth = [truth_of(f, e) for f, e in zip(fits, done.errors, strict=True)]
    each = [np.abs(f.values - t) <= f.margins() for f, t in zip(fits, truth, strict=True)]
    total = sum(len(t) * f.statistic(t) for f, t in zip(fits, truth, strict=True))
    values, freedom = sum(len(t) for t in truth), sum(f.freedom for f in fits)
    check, true = rod(seed, rng, world, done.alive, where)
    built = AsBuilt(SCENE, SETUP, fits)
    guess = rod_zeta(SCENE, built.setup, where, check.plan.rod, check.plan.detection, built.alive)
    return {
        "seed": seed,
        "found": done.found(fits),
        "rings": [bool(f.holds(t)) for f, t in zip(fits, truth, strict=True)],
        "all": bool(total <= values * stats.f.ppf(0.95, values, freedom)),
        "values": [bool(v) for e in each for v in e],
        "off": [[float(v) for v in np.abs(f.values - t)] for f, t in zip(fits, truth, strict=True)],
        "margin": [f.margins().tolist() for f in fits],
        "true": true,
        "share": [check.share.value, check.share.low, check.share.high],
        "proposed": check.predicted,
        "built": guess,
        "table": check.table.tolist(),
    }


def rod(
    seed: int, rng: np.random.Generator, world: World, alive: Bool[np.ndarray, " K"], where: Places
) -> tuple[RodCheck, float]:
    """Run the coverage check; return it and the true share."""
    plan = plan_rod(SCENE, SETUP, TARGET, seed=seed, where=where)
    before = world.readings(rng, plan.joints, plan.detection.before)
    every = world.readings(
        rng, plan.joints[plan.pose], plan.detection.frames, plan.rod.at(plan.point)
    )
    each = len(every) // len(plan.pose)
    trials = [every.only(np.arange(i * each, (i + 1) * each)) for i in range(len(plan.pose))]
    true = rod_zeta(SCENE, world.mounted, where, plan.rod, plan.detection, alive)
    return check_rod(plan, SETUP, before, trials), true


def _trials(found: list[dict[str, Any]]) -> str:
    """Return how many trials agree with their prediction."""
    (hit, missed), (extra, none) = np.sum([r["table"] for r in found], axis=0).tolist()
    return (
        f"Of {hit + missed} trials predicted covered {hit} were covered, of {extra + none}"
        f" predicted uncovered {none} were uncovered."
    )


def report(options: Sequence[str] = ()) -> list[str]:
    """Return the tables of all runs.

    ``--runs=N`` sets their number; ``--busy`` measures beside busy processes.
    """
    runs, processes = runs_of_options(options, RUNS), processes_of(options)
    now = code(__file__)
    both = measured("rig_checks", now, processes, lambda: _runs(runs, now, processes))
    figures = max((one.figures for one in both if one), key=len)
    return [*_tables(figures, planned(SCENE, SETUP)), "", *_under_load(*both)]


def _runs(runs: int, code: str, processes: int) -> list[dict[str, Any]]:
    """Return the results of all runs; those that the same code made under this load are kept."""
    kept = [json.loads(line) for line in KEPT.read_text().splitlines()] if KEPT.exists() else []
    done = {r["seed"]: r for r in kept if (r["code"], r.get("processes")) == (code, processes)}
    plan, where = planned(SCENE, SETUP), places(SCENE, TARGET, Rod())
    for seed in range(runs):
        if seed not in done:
            began = time.process_time()
            done[seed] = {"code": code, "processes": processes, **one(seed, plan, where)}
            done[seed]["processor"] = time.process_time() - began
            with KEPT.open("a") as file:
                file.write(json.dumps(done[seed]) + "\n")
    return [done[seed] for seed in range(runs)]


def _under_load(quiet: Measured | None, beside: Measured | None) -> list[str]:
    """Return the loads, and whether the same seeds gave the same figures under both."""
    lines = loads(quiet, beside)
    if quiet and beside:
        pairs = list(zip(quiet.figures, beside.figures, strict=False))  # seeds from 0
        same = sum(_timeless(a) == _timeless(b) for a, b in pairs)
        took = (np.median([r["processor"] for r in m.figures]) for m in (quiet, beside))
        seconds = " / ".join(f"{s:.1f}" for s in took)
        lines += [
            "",
            f"{same} of the {len(pairs)} runs that were made under both loads gave the same"
            f" figures. A run took {seconds} s of processor time (quiet / busy).",
        ]
    return lines


def _timeless(result: dict[str, Any]) -> dict[str, Any]:
    """Return a run's result without its time and load."""
    return {k: v for k, v in result.items() if k not in ("processes", "processor")}


def _tables(found: list[dict[str, Any]], plan: MountPlan) -> list[str]:
    def row(words: str, hits: Sequence[bool]) -> list[str]:
        share, p = (
            float(np.mean(hits)),
            stats.binomtest(int(sum(hits)), len(hits), 0.95, "less").pvalue,
        )
        return [
            words,
            str(len(hits)),
            f"{100 * share:.1f} %",
            f"{p:.3f}",
            "no" if p > 0.01 else "yes",
        ]

    rows = [
        row("all values of all rings in their joint confidence region", [r["all"] for r in found]),
        row(
            "all values of a ring in their joint confidence region",
            [ok for r in found for ok in r["rings"]],
        ),
        row("a value in its confidence interval", [ok for r in found for ok in r["values"]]),
        row(
            "the true share in the interval of the rod check",
            [r["share"][1] <= r["true"] <= r["share"][2] for r in found],
        ),
        *(
            row(f"exactly the injected {fault} reported", [r["found"][fault] for r in found])
            for fault in found[0]["found"]
        ),
    ]
    lines = (__doc__ or "").split("\n\n", 1)[1].strip().splitlines()
    lines += [
        "",
        (
            f"`python benchmarks rig_checks`, {len(found)} runs; with `--busy` beside eight busy"
            " processes. The last column is a one-sided binomial test of a rate of 95 % at the"
            " level of 1 %."
        ),
        "",
    ]
    lines += table(("statement", "trials", "true in", "p", "significantly below 95 %"), rows)
    scale = (1000.0, 180 / math.pi, 180 / math.pi, 1000.0)
    off, margin = (
        [
            [
                scale[k] * v
                for r in found
                for e in r[key]
                for k, v in zip(range(4 - len(e), 4), e, strict=True)
                if k == n
            ]
            for n in range(4)
        ]
        for key in ("off", "margin")
    )
    lines += [
        "",
        ("Errors of the estimates, and the stated 95 % margins:"),
        "",
    ]
    lines += table(
        (
            "error",
            "median",
            "95th percentile",
            "maximum",
            "median margin",
            "95th percentile of margins",
        ),
        [
            [
                name,
                *(
                    f"{v:.2f} {unit}"
                    for v in (
                        *np.percentile(off[n], (50, 95, 100)),
                        *np.percentile(margin[n], (50, 95)),
                    )
                ),
            ]
            for n, (name, unit) in enumerate(
                (("slip", "mm"), ("tilt", "°"), ("phase", "°"), ("offset", "mm"))
            )
        ],
    )
    width = [100 * (r["share"][2] - r["share"][1]) for r in found]
    agree = [r["share"][1] <= r["proposed"] <= r["share"][2] for r in found]
    built = [100 * abs(r["built"] - r["true"]) for r in found]
    off_by = [100 * abs(r["proposed"] - r["true"]) for r in found]
    took = np.median([r["processor"] for r in found])
    lines += [
        "",
        (
            f"The interval of the measured share is {np.median(width):.1f} points wide (median)."
            " It contains the share predicted for the proposal, which is off by up to"
            f" {max(off_by):.1f} points, in {100 * np.mean(agree):.0f} % of the runs. The share"
            f" predicted for the setup as built is off by at most {max(built):.2f} points."
            f" {_trials(found)}"
        ),
        "",
        (
            f"A run takes {took:.1f} s of processor time (median) and never waits: the readings"
            " come from the same simulation as in the simulated rig's processes."
        ),
    ]
    return lines
