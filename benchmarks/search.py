"""Search: time of the default command, answers to questions of the benchmark spread over seeds
beside the stored ones, and growth.

Each search runs in a process of its own on a core of its own, while the other cores run others.
"""

import resource
import statistics
import time
from tempfile import TemporaryDirectory
from typing import Any

from common import on_each_core, own_process, peak_memory, table
from entries import ours
from monte_carlo import estimate
from place_rings.objectives.criterion import judge
from place_rings.objectives.verify import Verifier
from place_rings.studies.benchmark.entries import ENTRIES, SECONDS
from place_rings.studies.benchmark.questions import QUESTIONS, Question
from place_rings.studies.benchmark.score import VOXEL, broken_rules
from start_up import PLACE, run

SEEDS = 3
_LOWER = 0.3  # points, by which a median may be lower
_COMMANDS = 3  # runs of the default command once all is compiled
_WALL = 8.0  # s, wanted of the default command
_DRAWN = 100_000  # random points that check the answer of one of SIZES
_MANY = {"spacing": 0.02, "max_rings_per_link": 32, "sensors_per_ring": [3, 48], "mount": "free"}
SIZES = {
    name: Question(name, "growth", n, {"targets": [{"name": "V_S", "radius": 1.5}], "rules": _MANY})
    for n in (125, 1000)
    for name in (f"{n} sensors",)
}
"""Questions that show how time and memory grow."""


def report(full: bool) -> list[str]:
    """Run the searches and return blocks of Markdown."""
    asked = [(own_process, value, name, seed) for name in QUESTIONS for seed in range(SEEDS)]
    found = iter(on_each_core(asked))
    values = {name: [next(found) for _ in range(SEEDS)] for name in QUESTIONS}
    return [command(), *against(values), *(sizes() if full else ())]


def value(name: str, seed: int) -> float:
    """Return the value of our answer within the equal budget, percent; 0 for one that breaks a
    rule."""
    question = QUESTIONS[name]
    setup = ours(question, SECONDS, seed)
    if broken_rules(question, setup):
        return 0.0
    return 100 * judge(Verifier(question.scene, VOXEL), setup, question.aim)[1]


def against(values: dict[str, list[float]]) -> list[str]:
    """Compare values by seed with the stored ones."""
    rows, lower, stored = [], 0, ENTRIES["place-rings"].heads
    for name, each in values.items():
        before, now = stored[name].percent or 0.0, statistics.median(each)
        gain = round(now - before, 4)
        lower += gain < -_LOWER
        spread = max(each) - min(each)
        row = [name, f"{before:.2f}", f"{now:.2f}", f"{round(gain, 2) + 0.0:+.2f}"]
        rows.append([*row, f"{spread:.2f}", "lower" if gain < -_LOWER else "-"])
    return [
        f"Answers within {SECONDS:g} s of processor time, beside the stored entry of the benchmark."
        f" Medians of {SEEDS} seeds; a spread is the largest less the smallest, in points. Marked:"
        f" a median lower by more than {_LOWER:g} points: {lower} of {len(values)}.",
        table(["question", "stored, %", "now, %", "gain, points", "spread", "mark"], rows),
    ]


def command() -> str:
    """Time the default command from its start to its end, alone on the machine."""
    seconds = []
    with TemporaryDirectory() as compiled:
        for _ in range(1 + _COMMANDS):
            began = time.perf_counter()
            run(PLACE, compiled)
            seconds.append(time.perf_counter() - began)
    first, *later = seconds
    return (
        f"`place-rings --target V_S --radius 0.5` takes {statistics.median(later):.1f} s from start"
        f" to end (median of {_COMMANDS} runs, wanted at most {_WALL:g} s), and {first:.1f} s for"
        " the first time, when Python and JAX compile."
    )


def sizes() -> list[str]:
    """Show how time and memory grow."""
    rows = []
    for name in SIZES:
        answer = own_process(grown, name)
        zeta, half = answer["random"]
        row = [name, f"{answer['processor_s']:.0f}", f"{answer['peak_mb']:.0f}"]
        rows.append([*row, f"{answer['value']:.2f}", f"{zeta:.2f} ± {half:.2f}"])
    heads = ("size", "processor s", "peak, MB", "exact value, %", "random points, %")
    return [
        "Growth: any rings on a UR10 under `shadow`, for V_S(1.5). Random points check the answers"
        " in plain NumPy, with their 95 % interval.",
        table(heads, rows),
    ]


def grown(name: str) -> dict[str, Any]:
    """Search one of ``SIZES`` to its end; return its value, time and memory."""
    question = SIZES[name]
    setup = ours(question, None)
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return {
        "peak_mb": peak_memory(),
        "processor_s": sum(u.ru_utime + u.ru_stime for u in used),
        "value": 100 * judge(Verifier(question.scene, VOXEL), setup, question.aim)[1],
        "random": [100 * part for part in estimate(question.scene, setup, _DRAWN, 0)],
    }
