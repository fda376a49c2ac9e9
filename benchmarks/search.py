"""Search: comparison with other optimisers, spread over seeds, modes and scale.

Each search runs in a process of its own on a core of its own, while the other cores run others.
"""

import math
import statistics
from collections.abc import Sequence
from dataclasses import replace

from common import absent, exponent, installed, on_each_core, own_process, table
from search_peers import FREE, OURS, PEERS, Run, ours, theirs
from search_questions import FULL, MODES, PLAIN, QUESTIONS, SCALE, SHORT, Plan, Question

LIMITS = {OURS: 0.3, FREE: 0.5}  # points, largest spread wanted over the seeds
_NOISE = 0.1  # tolerance of a fitted exponent


def report(full: bool) -> list[str]:
    """Run the searches of a plan and return blocks of Markdown."""
    plan = FULL if full else SHORT
    peers = [name for name in plan.peers if installed(PEERS[name][0])]
    questions = [QUESTIONS[name] for name in plan.questions]
    sizes = {name: SCALE[name][::step] for name, step in plan.scale.items()}
    tasks = [  # the longest first
        *((own_process, ours, q, 0) for series in sizes.values() for _, q in series),
        *((compared, q, seed, peers, plan.longer) for q in questions for seed in range(plan.seeds)),
        *((beside_plain, mode) for mode in MODES[: plan.modes]),
    ]
    results = iter(on_each_core(tasks))
    grown = {n: [(size, next(results)) for size, _ in series] for n, series in sizes.items()}
    runs = [run for _ in range(len(questions) * plan.seeds) for run in next(results)]
    modes = list(results)
    blocks = [*_comparison(plan, peers, runs), *_spread(plan, runs), *_modes(modes)]
    return [*blocks, *_scale(grown)]


def compared(question: Question, seed: int, peers: Sequence[str], longer: float) -> list[Run]:
    """Return the runs of ours with the given and with any rings, and of the peers."""
    mine = own_process(ours, question, seed, True)
    free = own_process(ours, replace(question, rings=None), seed)
    seconds = longer * mine.seconds
    return [mine, free, *(own_process(theirs, question, seed, peer, seconds) for peer in peers)]


def beside_plain(mode: Question) -> tuple[Run, float]:
    """Return the run of a mode, and the mean time of a plain search before and after it, s."""
    before, run, after = (own_process(ours, q, 0) for q in (PLAIN, mode, PLAIN))
    return run, (before.seconds + after.seconds) / 2


def _median(runs: Sequence[Run], question: str, method: str, of: str, *arguments: float) -> float:
    some = [r for r in runs if (r.question, r.method) == (question, method)]
    found = [getattr(r, of)(*arguments) if arguments else getattr(r, of) for r in some]
    return statistics.median(found)


def _seconds(value: float) -> str:
    return f"{value:.1f}" if math.isfinite(value) else "not reached"


def _comparison(plan: Plan, peers: Sequence[str], runs: Sequence[Run]) -> list[str]:
    """Compare ours with the peers on the same rings, as medians over the seeds."""
    heads = ["question, sensors", "ours, %", "s", *(f"{peer}, %" for peer in peers)]
    heads += ["ahead", "s to the best peer's value: peer", "ours", "peer / ours", f"{FREE}, %", "s"]
    rows, wrong = [], sum(run.rejected for run in runs)
    for name in plan.questions if peers else ():
        ends = {peer: _median(runs, name, peer, "exact") for peer in peers}
        rival = max(peers, key=lambda peer: ends[peer])
        mine, level = _median(runs, name, OURS, "exact"), ends[rival]
        slow, fast = (_median(runs, name, m, "reached", level) for m in (rival, OURS))
        spent = _median(runs, name, OURS, "seconds")
        row = [name, f"{mine:.2f}", f"{spent:.1f}"]
        row += [f"{_median(runs, name, p, 'best', spent):.2f} / {ends[p]:.2f}" for p in peers]
        row += [f"{mine - level:+.2f}", f"{rival}: {_seconds(slow)}", _seconds(fast)]
        row.append(f"{slow / fast:.1f}" if math.isfinite(fast) and math.isfinite(slow) else "-")
        free = (_median(runs, name, FREE, of) for of in ("exact", "seconds"))
        rows.append([*row, *(f"{value:.{2 - i}f}" for i, value in enumerate(free))])
    missing = [absent(PEERS[p][0], len(heads)) for p in plan.peers if p not in peers]
    return [
        "The first questions have real mounts and self-occlusion on V_S(0.5); the others, named by"
        " their targets, are of the paper's world on a UR10. All methods choose position, tilt and"
        f" phase of the same rings; only `{FREE}` also chooses links, rings and counts. Peers"
        " evaluate 8,192 points by the package's compiled estimator, with their own defaults, in"
        " the feasible set of our search; cells state their values in our processor time and in"
        f" {plan.longer:g} times as much, which the other columns compare with. Their clock starts"
        " after compilation, ours includes drawing points. Every answer that was a method's best is"
        " counted exactly (voxels of 1 cm) and checked against all rules."
        f" Medians of {plan.seeds} seeds; {wrong} answers broke a rule and do not count.",
        table(heads, [*rows, *missing]),
    ]


def _spread(plan: Plan, runs: Sequence[Run]) -> list[str]:
    """Show how far the answers of the seeds differ."""
    rows = []
    for name in plan.questions:
        for method, limit in LIMITS.items():
            zetas = [r.exact for r in runs if (r.question, r.method) == (name, method)]
            points = max(zetas) - min(zetas)
            row = [
                name,
                method,
                len(zetas),
                *(f"{f(zetas):.2f}" for f in (max, min)),
                f"{points:.2f}",
            ]
            rows.append([*row, f"{limit:g}", "yes" if points <= limit else "no"])
    heads = ("question, sensors", "method", "seeds", "best, %", "worst, %", "spread, points")
    return ["Spread over the seeds:", table((*heads, "wanted at most", "holds"), rows)]


def _modes(modes: Sequence[tuple[Run, float]]) -> list[str]:
    """Compare modes with a plain search."""
    rows = [
        (
            *(run.question, f"{run.seconds:.1f}", f"{run.seconds / plain:.2f}"),
            *(f"{run.exact:.2f}", run.rings, f"{run.peak:.0f}"),
        )
        for run, plain in modes
    ]
    return [
        "Modes: 80 sensors for V_S(0.5) on a UR10 in five rings unless a row says otherwise; seed"
        " 0. Ratios are to a plain search in the paper's world, before and after each. The value is"
        " that of the criterion.",
        table(("mode", "processor s", "ratio", "exact value, %", "rings", "peak, MB"), rows),
    ]


def _scale(grown: dict[str, list[tuple[float, Run]]]) -> list[str]:
    """Show how time and memory grow."""
    rows = []
    for name, each in grown.items():
        sizes, runs = zip(*each, strict=True)
        slopes = ["-", "-", "-"]
        if len(sizes) > 1:
            values = ([r.seconds for r in runs], [r.peak for r in runs])
            found = [exponent(sizes, some) for some in values]
            verdict = "yes" if max(found) <= 1 + _NOISE else "no"
            slopes = [*(f"{slope:.2f}" for slope in found), verdict]
        checks = (f"{r.check[0]:.2f} ± {r.check[1]:.2f}" if r.check else "-" for r in runs)
        columns = ([f"{s:g}" for s in sizes], [f"{r.seconds:.0f}" for r in runs])
        columns += ([f"{r.peak:.0f}" for r in runs], [f"{r.exact:.2f}" for r in runs])
        rows.append([name, *(" / ".join(some) for some in (*columns, checks)), *slopes])
    heads = ("what grows", "values", "processor s", "peak, MB", "exact value, %")
    more = ("random points, %", "exponent of time", "of memory", f"linear, within {_NOISE:g}")
    return [
        "Scale: any rings on a UR10 under `shadow`, for V_S(1.5) with 250 sensors unless they grow,"
        " for V_S(0.5) with 96 where poses grow. Points are those of the search's rounds. Random"
        " points check some answers in plain NumPy, with their 95 % interval.",
        table((*heads, *more), rows),
    ]
