"""Margins of mount checks whose frames come late, in simulated time.

Each run mounts the rig of `python benchmarks rig_checks` with its errors and faults and drives it
to 24 planned stops in simulated time: frames and states are sent at 25 and 125 a second and arrive
with the delays that were measured beside eight busy processes. They pass through the code of a real
check, which knows when each frame was measured by its ring's clock only. No wall clock takes part,
so a run gives the same figures on any machine.
"""

import hashlib
import json
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from common import table
from loads import busy
from place_rings.rig.mount.as_built import truth_of
from place_rings.rig.mount.fit import fit_mount
from place_rings.rig.mount.stop_plan import MountPlan, planned
from place_rings.rig.rings.line_monitor import Port
from place_rings.rig.rings.ports import RingReaders
from place_rings.rig.sensing.readings import Readings, at_stops
from place_rings.rig.simulated.process import SimulatedRig, command
from place_rings.rig.simulated_cell.ground_truth import injected
from place_rings.rig.simulated_cell.late_frames import BUSY, counted
from place_rings.rig.simulated_cell.simulated_time import mount_check
from rig_checks import SCENE, SETUP
from scipy import stats

RUNS, BUSY_PROCESSES = 200, 8
KEPT = Path("rig_late.jsonl")  # in the current folder: runs of the same code are not repeated
_RINGS, _RATE, _CLOCK_RATE = 5, 25.0, 1 - 40e-6


def one(seed: int, plan: MountPlan) -> dict[str, Any]:
    """Run a check once and return the results as plain values."""
    rng, done = np.random.default_rng((seed, 9)), injected(SCENE, SETUP, seed)
    gathered = mount_check(done.world(SCENE), plan.joints, plan.frames, rng, BUSY)
    readings = counted(Readings(*gathered.rows(len(SETUP.groups))), gathered)
    stops = at_stops(readings, SETUP, plan.joints)
    fits = fit_mount(SCENE, SETUP, stops)
    truth = [truth_of(f, e) for f, e in zip(fits, done.errors, strict=True)]
    each = [np.abs(f.values - t) <= f.margins() for f, t in zip(fits, truth, strict=True)]
    return {
        "seed": seed,
        "rings": [bool(f.holds(t)) for f, t in zip(fits, truth, strict=True)],
        "values": [bool(v) for e in each for v in e],
        "fewest": int(stops.total.min()),
        "found": all(done.found(fits).values()),
    }


def measured(seconds: float, processes: int) -> list[float]:
    """Return the delays (s) of the frames of a simulated ring beside busy processes, relative to
    the quickest, of the last of five rings that one process reads.
    """
    times = list[tuple[float, float]]()
    with (
        SimulatedRig((("-m", "place_rings.rig.simulated"), command(_RINGS, 16, _RATE))) as rig,
        RingReaders(
            [Port(rig.ring(i), 16, patience=100.0) for i in range(_RINGS)],
            lambda ring, f: times.append((f.time, f.clock)) if ring == _RINGS - 1 else None,
        ) as rings,
        busy(processes),
    ):
        rings.wait(20)
        time.sleep(2)
        times.clear()
        time.sleep(seconds)
    arrived, clock = np.array(times).T
    delay = arrived - clock / _CLOCK_RATE
    return np.sort(delay - delay.min()).tolist()


def report(options: Sequence[str] = ()) -> list[str]:
    """Return the table of all runs; ``--runs=N`` sets their number."""
    runs = int(next((o.partition("=")[2] for o in options if o.startswith("--runs=")), RUNS))
    kept = [json.loads(line) for line in KEPT.read_text().splitlines()] if KEPT.exists() else []
    done = {r["seed"]: r for r in kept if r["code"] == code()}
    return _tables([done.get(seed) or _kept(seed) for seed in range(runs)])


def code() -> str:
    """Return a fingerprint of the rig's loaded files and of this one."""
    loaded = [m for name, m in sys.modules.items() if name.startswith("place_rings.rig.")]
    files = {__file__, *(str(m.__file__) for m in loaded)}
    data = b"".join(Path(file).read_bytes() for file in sorted(files))
    return hashlib.sha256(data).hexdigest()[:16]


def _kept(seed: int) -> dict[str, Any]:
    """Run once and keep the result."""
    result = {"code": code(), **one(seed, _PLAN[0] if _PLAN else _planned())}
    with KEPT.open("a") as file:
        file.write(json.dumps(result) + "\n")
    return result


_PLAN: list[MountPlan] = []


def _planned() -> MountPlan:
    _PLAN.append(planned(SCENE, SETUP))
    return _PLAN[0]


def _tables(found: Sequence[dict[str, Any]]) -> list[str]:
    def row(words: str, hits: Sequence[bool]) -> list[str]:
        p = stats.binomtest(int(sum(hits)), len(hits), 0.95, "less").pvalue
        share = f"{100 * float(np.mean(hits)):.1f} %"
        return [words, str(len(hits)), share, f"{p:.3f}", "no" if p > 0.01 else "yes"]

    rows = [
        row("all values of a ring in their joint confidence region", _all(found, "rings")),
        row("a value in its confidence interval", _all(found, "values")),
        row("exactly the injected faults reported", [r["found"] for r in found]),
    ]
    delays = [[f"{100 * share:g} %", f"{1000 * s:.1f} ms"] for share, s in BUSY.quantiles]
    fewest = [r["fewest"] for r in found]
    return [
        *(__doc__ or "").split("\n\n", 1)[1].strip().splitlines(),
        "",
        f"`python benchmarks rig_late`, {len(found)} runs. The last column is a one-sided binomial"
        " test of a rate of 95 % at the level of 1 %.",
        "",
        *table(("statement", "trials", "true in", "p", "significantly below 95 %"), rows),
        "",
        f"Late frames leave at least {min(fewest)} readings of a sensor at a stop, of 10 wanted"
        f" (median of the runs' fewest: {np.median(fewest):.0f}).",
        "",
        "Delays, measured once (`python benchmarks/rig_late.py 120 8`: seconds, busy processes):",
        "",
        *table(("of the frames", "at most"), delays),
    ]


def _all(found: Sequence[dict[str, Any]], key: str) -> list[bool]:
    return [ok for r in found for ok in r[key]]


if __name__ == "__main__":
    if sys.argv[1] == "seeds":
        for number in range(int(sys.argv[2]), int(sys.argv[3])):
            print(_kept(number), flush=True)
    else:
        known = np.quantile(measured(float(sys.argv[1]), int(sys.argv[2])), BUSY.share)
        for share, s in zip(BUSY.share, known, strict=True):
            print(f"{100 * share:g} % of the frames at most {1000 * s:.1f} ms late")
