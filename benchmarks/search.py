"""Search: answers and processor time against those of an earlier search, spread over seeds, the
default command, and other optimisers.

Each search runs in a process of its own on a core of its own, while the other cores run others.
"""

import csv
import json
import os
import statistics
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from common import absent, installed, on_each_core, own_process, say, table
from search_peers import PEERS, theirs
from search_questions import QUESTIONS, SIZES
from start_up import PLACE, run

SEEDS = 3
_LOWER = {False: 0.1, True: 0.3}  # points, by which a median may be lower; True: any rings
_LONGER = 1.5  # times the earlier processor time that a search may take
_COMMANDS = 3  # runs of the default command once all is compiled
_WALL = 8.0  # s, wanted of the default command
_COMPARED = ("near", "far", "paper_near", "paper_far")  # questions that the peers answer, too
_HERE = Path(__file__).parent
_BASELINE = _HERE / "search_baseline.csv"

Answers = dict[str, list[dict[str, Any]]]
"""What the searches of each question returned, by seed."""


def report(full: bool) -> list[str]:
    """Run the searches and return blocks of Markdown."""
    before, source = baseline()
    spent = {name: sum(_column(before[name], "processor_s")) for name in QUESTIONS}
    minutes = sum(spent.values()) / len(os.sched_getaffinity(0)) / 60
    say(f"the searches took {minutes:.0f} minutes before; the peers take about 4, the rest 2")
    blocks, now = [command()], defaultdict(list)
    asked = [(name, 0) for name in SIZES if full]
    longest = sorted(spent, key=spent.get, reverse=True)
    asked += [(name, seed) for seed in range(SEEDS) for name in longest]
    with TemporaryDirectory() as compiled:
        answers = on_each_core([(searched, *one, compiled) for one in asked])
    for (name, _), answer in zip(asked, answers, strict=True):
        now[name].append(answer)
    blocks += [*against(before, now, source), *stages(now), *peers(now)]
    return [*blocks, *(sizes(now) if full else ())]


def baseline() -> tuple[Answers, str]:
    """Return the stored answers of the earlier search, and the comment that tells their source."""
    lines = _BASELINE.read_text("utf-8").splitlines()
    before: Answers = defaultdict(list)
    for row in csv.DictReader(line for line in lines if not line.startswith("#")):
        value, seconds = float(row["exact_percent"]), float(row["processor_s"])
        before[row["question"]].append({"value": value, "processor_s": seconds})
    return before, " ".join(line[1:].strip() for line in lines if line.startswith("#"))


def searched(name: str, seed: int, compiled: str) -> dict[str, Any]:
    """Return what ``search_run`` prints for a question and a seed; ``compiled``: folder of what JAX
    compiles, which the command keeps, too."""
    words = [sys.executable, str(_HERE / "search_run.py"), name, str(seed)]
    kept = {
        "JAX_COMPILATION_CACHE_DIR": compiled,
        "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0.1",
    }
    printed = subprocess.check_output(words, text=True, env=os.environ | kept)
    answer: dict[str, Any] = json.loads(printed)
    return answer


def _column(answers: Sequence[dict[str, Any]], name: str) -> list[float]:
    """Return the values of a column; that of an answer that breaks a rule is 0."""
    return [answer[name] or 0.0 for answer in answers]


def against(before: Answers, now: Answers, source: str) -> list[str]:
    """Compare answers and processor time with the stored ones."""
    rows, ahead, marked = [], 0, 0
    for name, question in QUESTIONS.items():
        values = [_column(some[name], "value") for some in (before, now)]
        seconds = [statistics.median(_column(some[name], "processor_s")) for some in (before, now)]
        first = _column(now[name], "processor_s")[0]
        medians = [statistics.median(each) for each in values]
        gain, ratio = round(medians[1] - medians[0], 4), seconds[1] / seconds[0]
        marks = ["lower"] * (gain < -_LOWER[question.sensors is not None])
        marks += ["slower"] * (ratio > _LONGER)
        ahead, marked = ahead + (gain > 0), marked + bool(marks)
        spreads = [max(each) - min(each) for each in values]
        row = [name, *(f"{value:.2f}" for value in medians), f"{round(gain, 2) + 0.0:+.2f}"]
        row += [*(f"{spread:.2f}" for spread in spreads), *(f"{each:.1f}" for each in seconds)]
        row.append(f"{first:.1f}")
        rows.append([*row, f"{ratio:.2f}", ", ".join(marks) or "-"])
    broken = sum(answer["value"] is None for name in QUESTIONS for answer in now[name])
    heads = ["question", "before, %", "now, %", "gain, points", "spread before", "spread now"]
    heads += ["processor s before", "now", "first", "ratio", "mark"]
    return [
        f"Before: {source} Medians of {SEEDS} seeds, of exact values (voxels of 1 cm) of the"
        " criterion; a spread is the largest less the smallest, in points. Marked: a median lower"
        f" by more than {_LOWER[False]:g} points ({_LOWER[True]:g} with any rings), and processor"
        f" time of more than {_LONGER:g} times. The first seed compiles what the others use, as the"
        f" command keeps it; `first` is its time. {ahead} of {len(QUESTIONS)} medians are higher,"
        f" {marked} questions are marked. All answers are judged against all rules; {broken} broke"
        " one and count as 0.",
        table(heads, rows),
    ]


def stages(now: Answers) -> list[str]:
    """Show what each stage of the search reached and took, where the search says so."""
    rows = []
    for name in QUESTIONS:
        stages = now[name][0]["stages"]
        rows += [[name, *(_shown(value) for value in stage.values())] for stage in stages]
    if not rows:
        return []
    heads = next(list(some[0]["stages"][0]) for some in now.values() if some[0]["stages"])
    return ["Stages of the searches with seed 0:", table(["question", *heads], rows)]


def _shown(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


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


def peers(now: Answers) -> list[str]:
    """Compare with other optimisers in the median processor time of our search."""
    kept = [name for name, (package, _) in PEERS.items() if installed(package)]
    spent = {name: statistics.median(_column(now[name], "processor_s")) for name in _COMPARED}
    tasks = [(peer, name, seed) for name in _COMPARED for peer in kept for seed in range(SEEDS)]
    found = on_each_core([(own_process, theirs, *task, spent[task[1]]) for task in tasks])
    values: dict[tuple[str, str], list[float]] = defaultdict(list)
    for (peer, name, _), answers in zip(tasks, found, strict=True):
        values[name, peer].append(max((v for v in answers if v is not None), default=0.0))
    rows = []
    for name in _COMPARED:
        ours = statistics.median(_column(now[name], "value"))
        each = [statistics.median(values[name, peer]) for peer in kept]
        row = [name, f"{spent[name]:.1f}", f"{ours:.2f}", *(f"{value:.2f}" for value in each)]
        rows.append([*row, f"{ours - max(each):+.2f}" if each else "-"])
    broken = sum(value is None for answers in found for value in answers)
    heads = ["question", "processor s", "ours, %", *(f"{peer}, %" for peer in kept), "ahead"]
    missing = [absent(PEERS[peer][0], len(heads)) for peer in PEERS if peer not in kept]
    return [
        "Other optimisers choose position, tilt and phase of the same rings. They have the median"
        " processor time of our search, theirs without start-up and compilation. They evaluate"
        " 8,192 points as the global stage of our search counts them, with their own defaults, in"
        " the feasible set of our search. The last three answers that were a peer's best are"
        " counted and judged as ours are, and the best of them counts; medians of the seeds."
        f" {broken} answers broke a rule.",
        table(heads, rows + missing),
    ]


def sizes(now: Answers) -> list[str]:
    """Show how time and memory grow."""
    rows = []
    for name in SIZES:
        (answer,) = now[name]
        zeta, half = answer["random"]
        row = [name, f"{answer['processor_s']:.0f}", f"{answer['peak_mb']:.0f}"]
        rows.append([*row, f"{answer['value'] or 0:.2f}", f"{zeta:.2f} ± {half:.2f}"])
    heads = ("size", "processor s", "peak, MB", "exact value, %", "random points, %")
    return [
        "Growth: any rings on a UR10 under `shadow`, for V_S(1.5). Random points check the answers"
        " in plain NumPy, with their 95 % interval.",
        table(heads, rows),
    ]
