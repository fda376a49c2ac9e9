"""Search for detection: searches that maximise it beside searches for ζ, both judged by the exact
count of detection.
"""

import statistics
import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from common import on_each_core, table
from place_rings.coverage.definitions.definition import adapter
from place_rings.coverage.detection.detection import Detection
from place_rings.coverage.detection.pieces import PIECES
from place_rings.objectives.criterion import Criterion, judge
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier
from place_rings.placement.search.context import SearchContext
from place_rings.placement.search.options import SearchOptions
from place_rings.placement.search.search import search
from place_rings.placement.space.design import Space
from place_rings.simulation.pick_and_place import pick_and_place

_SEEDS = {False: 1, True: 3}
_EFFORT, _VOXEL = 0.3, 0.02
_NEAR, _SHELL, _FAR = (
    {"name": "V_N", "radius": 0.3},
    {"name": "V_S", "radius": 0.5},
    {"name": "V_S", "radius": 1.0},
)
_TABLE = {"name": "table", "centre": [0.8, 0, -0.1], "size": [0.6, 1.2, 0.2]}


class Case(NamedTuple):
    """A scene with a sensor and a test piece."""

    keys: Mapping[str, Any]
    """Keys of the scene."""
    sensors: int
    """Number of sensors in any rings."""
    piece: str
    """The test piece."""
    task_poses: int = 0
    """Poses of the paper's task, at equal time steps; 0: those of the scene."""

    def scene(self) -> Scene:
        """Return the scene."""
        scene: Scene = adapter(Scene).validate_python(self.keys)
        if not self.task_poses:
            return scene
        q = pick_and_place(scene.robot, 50.0).q
        steps = np.round(np.linspace(0, len(q) - 1, self.task_poses)).astype(int)
        return replace(scene, poses=tuple(Pose(q[i]) for i in steps))


def _case(
    model: str, piece: str, sensors: int, *targets: dict[str, object], **more: object
) -> Case:
    poses = int(more.pop("task_poses", 0))  # type: ignore[call-overload]
    keys = {"targets": list(targets), "sensor": {"model": model}, "electronics": {"bus": "own"}}
    return Case(keys | more, sensors, piece, poses)


CASES = {
    "UR10, V_S(0.5)": _case("vl53l1x", "hand", 48, _SHELL),
    "UR10, V_N(0.3)": _case("vl53l5cx", "hand", 24, _NEAR),
    "UR5e, obstacle": _case("vl53l1x", "arm", 40, _NEAR, robot="ur5e", obstacles=[_TABLE]),
    "Panda, V_N(0.3)": _case("vl53l1x", "hand", 40, _NEAR, robot="panda"),
    "UR10, near and far": _case(
        "vl53l5cx", "torso", 24, _NEAR | {"weight": 0.6}, _FAR | {"weight": 0.4}
    ),
    "UR10, task": _case("vl53l5cx", "arm", 24, _SHELL, task_poses=6),
}
"""Scenes, sensors and test pieces by name."""


def report(full: bool) -> list[str]:
    """Run the searches and return blocks of Markdown."""
    seeds = range(_SEEDS[full])
    asked = [(answered, name, aim, seed) for name in CASES for seed in seeds for aim in (0, 1)]
    answers = dict(zip([a[1:] for a in asked], on_each_core(asked), strict=True))
    rows = []
    for name, case in CASES.items():
        model = case.keys["sensor"]["model"]
        plain, own = ([answers[name, aim, seed] for seed in seeds] for aim in (0, 1))
        gains = [b[0] - a[0] for a, b in zip(plain, own, strict=True)]
        medians = [statistics.median(a[i] for a in some) for some in (plain, own) for i in (0, 1)]
        row = [name, f"{case.sensors} {model}", case.piece]
        row += [f"{value:.2f}" for value in medians]
        row += [f"{statistics.median(gains):+.2f}", f"{min(gains):+.2f} to {max(gains):+.2f}"]
        row += [f"{statistics.median(a[2] for a in some):.0f}" for some in (plain, own)]
        rows.append(row)
    heads = ["scene", "sensors", "piece", "for ζ: detection, %", "ζ, %", "for detection: %", "ζ, %"]
    heads += ["gain, points", "over seeds", "s", "s"]
    return [
        f"Medians of {len(seeds)} seeds, by exact counts (voxels of {_VOXEL:g} m); effort"
        f" {_EFFORT:g}; the piece within 0.2 s by one sensor.",
        table(heads, rows),
    ]


def answered(name: str, aim: int, seed: int) -> tuple[float, float, float]:
    """Return expected detection and ζ of a search's answer, in percent, and its time, s.

    Args:
        name: the case.
        aim: 0: the search maximises ζ; 1: detection.
        seed: random seed.
    """
    case = CASES[name]
    scene, detection = case.scene(), Detection(piece=PIECES[case.piece])
    verifier, began = Verifier(scene, _VOXEL), time.monotonic()
    aims = Criterion(), Criterion(detection=detection)
    options = SearchOptions(effort=_EFFORT, seed=seed)
    answer = search(Space(scene, sensors=case.sensors), options, SearchContext(verifier, aims[aim]))
    seconds = time.monotonic() - began
    zeta, detected = (100 * judge(verifier, answer.setup, each)[1] for each in aims)
    return detected, zeta, seconds
