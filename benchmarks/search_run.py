"""One search of the benchmark, in a process of its own.

Run: python benchmarks/search_run.py QUESTION SEED

It prints a line of JSON: the exact value in percent, null where the answer breaks a rule, and the
processor seconds of the process until the answer, its start-up included.
"""

import dataclasses
import json
import resource
import sys
from typing import Any

from place_rings.coverage.rings.ring import Setup
from place_rings.objectives.criterion import Criterion, judge
from place_rings.objectives.feasibility.violations import faults
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier
from place_rings.placement.search.context import SearchContext
from place_rings.placement.search.options import SearchOptions
from place_rings.placement.search.search import search
from search_questions import QUESTIONS, SIZES

_VOXEL = 0.01  # m, of the exact count
_DRAWN = 100_000  # random points that check the answer of one of SIZES


def exact(scene: Scene, setup: Setup, aim: Criterion, voxel: float = _VOXEL) -> float | None:
    """Return the exact value of an answer, percent; None for one that breaks a rule."""
    if faults(scene, setup.rings):
        return None
    return round(100 * judge(Verifier(scene, voxel), setup, aim)[1], 4)


def run(name: str, seed: int) -> dict[str, Any]:
    """Search, and return what it found and took."""
    question = QUESTIONS[name] if name in QUESTIONS else SIZES[name]
    scene = question.made()
    context = SearchContext(Verifier(scene), question.aim)
    found = search(question.space(scene), SearchOptions(seed=seed), context)
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    from common import peak_memory  # what it imports is not counted

    result = {
        "peak_mb": peak_memory(),
        "value": exact(scene, found.setup, question.aim),
        "processor_s": round(sum(u.ru_utime + u.ru_stime for u in used), 2),
        "stages": [dataclasses.asdict(stage) for stage in getattr(found, "stages", ())],
    }
    if name in SIZES:
        from monte_carlo import estimate

        result["random"] = [100 * part for part in estimate(scene, found.setup, _DRAWN, 0)]
    return result


if __name__ == "__main__":
    print(json.dumps(run(sys.argv[1], int(sys.argv[2]))))
