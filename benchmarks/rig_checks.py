"""Checks of a simulated rig: recovery of injected mounting errors and faults, and of coverage.

Each run mounts five rings of 16 sensors on a UR10 in a cell of floor, table and box. Each ring is
off by up to 20 mm along its link, 5° of tilt and 5° of phase, and its readings are off by up to 20
mm. In one ring two sensors are swapped, one of all sensors is dead, and one ring is reversed: wired
in reverse, or mounted the other way round. Readings have noise of 5 mm and 1 % of the distance, are
rounded to 1 mm, and 2 % are lost. The mount check stops at 24 planned poses with 10 frames each.
The coverage check puts a rod at 120 points, at three poses, planned for the setup as proposed. The
true share is counted at every voxel of the target with the rings as mounted. In the runs with late
frames, frames and states arrive in simulated time with the delays that were measured beside eight
busy processes, and pass through the code of a real check.
"""

import math
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from multiprocessing import get_context
from typing import Any

import numpy as np
from common import say, table
from jaxtyping import Bool
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.solids.polyhedra import box, half_space
from place_rings.coverage.targets.named import Shell
from place_rings.objectives.obstacle import Obstacle
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.rig.mount.as_built import AsBuilt
from place_rings.rig.mount.fit import fit_mount
from place_rings.rig.mount.fit_record import truth_of
from place_rings.rig.mount.stop_plan import MountPlan, planned
from place_rings.rig.rod.coverage_estimate import RodCheck, check_rod
from place_rings.rig.rod.rod import Rod
from place_rings.rig.rod.trial_plan import Places, places, plan_rod, rod_zeta
from place_rings.rig.sensing.readings import at_stops
from place_rings.rig.simulated_cell.ground_truth import injected
from place_rings.rig.simulated_cell.simulated_time import BUSY, mount_check
from place_rings.rig.simulated_cell.world import World
from scipy import stats

TARGET = Shell(0.5)
_POSES = (0, -45, 60, -105, -90, 0), (40, -70, 90, -110, -90, 0), (-60, -60, 50, -80, -90, 0)
SCENE = Scene.paper(
    poses=tuple(Pose(np.radians(q)) for q in _POSES),
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
_VALUES = (("slip", "mm", 1000.0), ("tilt", "°", 180 / math.pi), ("phase", "°", 180 / math.pi))
VALUES = (*_VALUES, ("offset", "mm", 1000.0))
RATE, LEVEL = 0.95, 0.01  # stated rate, and the level at which a test rejects it


@cache
def plans() -> tuple[MountPlan, Places]:
    """Return the planned stops and the places of the rod, which all runs share."""
    return planned(SCENE, SETUP), places(SCENE, TARGET, Rod())


def one(seed: int, late: bool) -> dict[str, Any]:
    """Run the checks once and return the results as plain values; late frames are those of the
    mount check only.
    """
    plan, where = plans()
    rng, done = np.random.default_rng((seed, 9 if late else 8)), injected(SCENE, SETUP, seed)
    world = done.world(SCENE)
    if late:
        readings = mount_check(world, plan.joints, plan.frames, rng, BUSY)
    else:
        readings = world.readings(rng, plan.joints, plan.frames)
    stops = at_stops(readings, SETUP, plan.joints)
    fits = fit_mount(SCENE, SETUP, stops)
    truth = [truth_of(f, e) for f, e in zip(fits, done.errors, strict=True)]
    off = [np.abs(f.values - t) for f, t in zip(fits, truth, strict=True)]
    result = {
        "fewest": int(stops.total.min()),
        "found": done.found(fits),
        "rings": [bool(f.holds(t)) for f, t in zip(fits, truth, strict=True)],
        "off": [each.tolist() for each in off],
        "margin": [f.margins().tolist() for f in fits],
        "values": [bool(v) for f, e in zip(fits, off, strict=True) for v in e <= f.margins()],
    }
    if late:
        return result
    total = sum(len(t) * f.statistic(t) for f, t in zip(fits, truth, strict=True))
    values, freedom = sum(map(len, truth)), sum(f.freedom for f in fits)
    check, true = rod(seed, rng, world, done.alive, where)
    built = AsBuilt(SCENE, SETUP, fits)
    guess = rod_zeta(SCENE, built.setup, where, check.plan.rod, check.plan.detection, built.alive)
    return result | {
        "all": bool(total <= values * stats.f.ppf(RATE, values, freedom)),
        "true": true,
        "share": (check.share.low, check.share.high),
        "proposed": check.predicted,
        "built": guess,
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


def report(runs: int, late: int) -> list[str]:
    """Run checks with frames in time and with late ones, and return blocks of Markdown."""
    seeds = [*range(runs), *range(late)]
    with ProcessPoolExecutor(mp_context=get_context("spawn")) as pool:
        found = list(pool.map(one, seeds, [i >= runs for i in range(len(seeds))]))
    heads = (
        "statement",
        "frames",
        "trials",
        "true in",
        "p",
        f"significantly below {100 * RATE:g} %",
    )
    rows = [*statements(found[:runs], "in time"), *statements(found[runs:], "late")]
    for row in rows:
        say(*row)
    width = [100 * (high - low) for low, high in (r["share"] for r in found[:runs])]
    built, proposed = (
        [100 * abs(r[key] - r["true"]) for r in found[:runs]] for key in ("built", "proposed")
    )
    return [
        (__doc__ or "").split("\n\n", 1)[1].strip().replace("\n", " "),
        f"The last column is a one-sided binomial test of a rate of {100 * RATE:g} % at the level"
        f" of {100 * LEVEL:g} %.",
        table(heads, rows),
        "Errors of the estimates, and their stated margins:",
        errors(found[:runs]),
        f"The interval of the measured share is {np.median(width):.1f} points wide (median). The"
        f" share predicted for the setup as built is off by at most {max(built):.2f} points, that"
        f" predicted for the proposal by at most {max(proposed):.1f}. Late frames leave at least"
        f" {min(r['fewest'] for r in found[runs:])} readings of a sensor at a stop, of 10 wanted.",
    ]


def statements(found: Sequence[dict[str, Any]], frames: str) -> Iterator[list[str]]:
    """Yield the rows of the statements that should be true in 95 % of the trials."""
    hits: dict[str, list[bool]] = {}
    if "all" in found[0]:
        hits["all values of all rings in their joint confidence region"] = [r["all"] for r in found]
        inside = [r["share"][0] <= r["true"] <= r["share"][1] for r in found]
        hits["the true share in the interval of the rod check"] = inside
    joint = "all values of a ring in their joint confidence region"
    hits[joint] = [ok for r in found for ok in r["rings"]]
    hits["a value in its confidence interval"] = [ok for r in found for ok in r["values"]]
    for fault in found[0]["found"]:
        hits[f"exactly the injected {fault} reported"] = [r["found"][fault] for r in found]
    for text, each in hits.items():
        p = stats.binomtest(sum(each), len(each), RATE, "less").pvalue
        share, verdict = f"{100 * np.mean(each):.1f} %", "no" if p > LEVEL else "yes"
        yield [text, frames, str(len(each)), share, f"{p:.3f}", verdict]


def errors(found: Sequence[dict[str, Any]]) -> str:
    """Return the table of errors and margins by value; a ring without a slip has the last three."""
    rows = []
    for n, (name, unit, scale) in enumerate(VALUES):
        off, margin = (
            [scale * ring[n - 4] for r in found for ring in r[key] if len(ring) >= 4 - n]
            for key in ("off", "margin")
        )
        figures = (*np.percentile(off, (50, 95, 100)), *np.percentile(margin, (50, 95)))
        rows.append([name, *(f"{v:.2f} {unit}" for v in figures)])
    heads = ("error", "median", "95th percentile", "maximum", "median margin")
    return table((*heads, "95th percentile of margins"), rows)
