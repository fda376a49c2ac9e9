"""Pareto fronts of near and far coverage: comparison with NSGA-II in equal time.

Run: python benchmarks fronts            three seeds
     python benchmarks fronts --seeds=1
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from common import installed, missing, table
from place_rings.coverage.rings.ring import Setup
from place_rings.coverage.targets import Target
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.scene import Goal, paper_scene
from place_rings.objectives.verify import Verifier
from place_rings.studies.engine.registry import TASKS
from place_rings.studies.engine.scenes import setup_from
from place_rings.studies.engine.store import Cell
from place_rings.studies.pareto import study as pareto
from search_scenes import layout
from search_task import OverError, Question, Watch, processor_seconds

TARGETS = (Target("V_S", 0.5), Target("V_S", 1.5))
SENSORS, FLOORS = 80, 30
_PEER = "pymoo"
_VOXEL = 0.02  # m, voxels of the exact count
_POPULATION = 100  # pymoo's default
_RULES = Rules(spacing=0.0)
_KEYS: dict[str, Any] = {"rules": {"spacing": 0.0}}


def ours(seed: int, any_rings: bool) -> tuple[list[Setup], float]:
    """Search setups of the paper's layout or of any rings; return them and the time in seconds."""

    def run(heading: str, cells: list[Cell]) -> list[Any]:
        found = []
        for cell in cells:
            arguments = dict(cell.arguments)
            if cell.work == "place" and not any_rings:
                arguments |= {"sensors": None, "rings_per_link": 2, "sensors_per_ring": 16}
            found.append(TASKS[cell.work](**arguments))
        return found

    began = processor_seconds()
    points = pareto.measure(run, _KEYS, TARGETS, {SENSORS: FLOORS}, seed)
    spent = processor_seconds() - began
    scene = paper_scene(rules=_RULES)
    return [setup_from(p.rings, scene) for p in points if not pareto.is_papers(p)], spent


def nsga2(seed: int, seconds: float) -> list[Setup]:
    """Return the last front of pymoo's NSGA-II with its defaults, on the paper's layout."""
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.problem import Problem
    from pymoo.core.termination import NoTermination

    watch = Watch(seconds)
    scenes = [paper_scene(goals=(Goal(t),), rules=_RULES) for t in TARGETS]
    wanted = layout(scenes[0], SENSORS)
    questions = [Question(scene, wanted, seed, watch) for scene in scenes]

    class Coverage(Problem):
        def __init__(self) -> None:
            super().__init__(n_var=questions[0].size, n_obj=2, xl=0.0, xu=1.0)

        def _evaluate(self, x: Any, out: dict[str, Any], *_: Any, **__: Any) -> None:
            out["F"] = -np.stack([q.shares(x) for q in questions], axis=1)

    algorithm = NSGA2(pop_size=_POPULATION)
    algorithm.setup(Coverage(), termination=NoTermination(), seed=seed)
    front: Any = None
    try:
        while True:
            algorithm.next()
            front = algorithm.opt.get("X")
    except OverError:
        return [] if front is None else [questions[0].setup(x) for x in front]


def area(setups: Sequence[Setup]) -> float:
    """Return the hypervolume of exactly counted setups as a share of the unit square."""
    verifier = Verifier(paper_scene(), _VOXEL)
    return pareto.hypervolume(
        [tuple(100 * verifier.verify(s, t).zeta for t in TARGETS) for s in setups]
    )


def report(arguments: Sequence[str] = ()) -> list[str]:
    """Return hypervolumes by seed."""
    if not installed(_PEER):
        return [missing(_PEER)]
    seeds = int(next((a.partition("=")[2] for a in arguments if a.startswith("--seeds=")), "3"))
    rows = []
    for seed in range(seeds):
        found = [("ours", *ours(seed, any_rings=False))]
        if seed == 0:
            found.append(("ours, any rings", *ours(seed, any_rings=True)))
        spent = found[0][2]
        found.append(("NSGA-II", nsga2(seed, spent), spent))
        rows += [
            (seed, name, f"{s:.0f}", len(setups), f"{area(setups):.4f}")
            for name, setups, s in found
        ]
        print(*rows[-len(found) :], sep="\n", flush=True)
    return [
        (
            f"{TARGETS[0]} against {TARGETS[1]}, {SENSORS} sensors in the paper's five rings of"
            " 16, which may touch. `any rings` chooses its rings freely, which the peer cannot"
            f" do; one seed. Our search spends three ends and {FLOORS} floors, including counts."
            f" NSGA-II (pymoo, its defaults, {_POPULATION} setups per generation) gets the same"
            " processor time on a compiled objective. All setups are then counted exactly"
            f" with voxels of {_VOXEL:g} m."
        ),
        "",
        *table(
            (
                "seed",
                "search",
                "processor seconds",
                "setups",
                "hypervolume",
            ),
            rows,
        ),
    ]
