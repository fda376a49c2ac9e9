"""Does ζ of detection predict who is noticed? Predictions beside a twin in MuJoCo.

Each layout answers the same questions, and a few drawn ones: a test piece at random places of a
target. People walk around each as well.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from ...coverage.detection.pieces import PIECES
from ...coverage.sensors.catalogue import MODELS
from ...coverage.targets.named import Near, Shell
from ...coverage.targets.target import Target
from ...formats.layouts.layout import read_layout
from ...objectives.detection_share import LAW_ERROR
from ..engine.scenes import Rings, Sensors, goal_keys, keys_of, setup_keys
from ..engine.store import Cell, Measure
from ..engine.tasks import zeta_cell
from ..layouts.study import PUBLISHED
from . import tasks
from .spheres import SphereTrials

SHELL, NEAR = Shell(0.5), Near(0.3)
PLACES = 240
"""Places at which each question is tried."""
SPHERES = 60
"""Places at which a sphere above the largest unseen one stands, at most."""
DRAWN = 3
"""Drawn questions for each layout."""
WALKS = 1
"""Number of walks around each layout."""
CALIBRATED = 200
"""Predictions that are drawn for the test of calibration."""
NAMED = {
    None: ("n1_8_0", "n2_16_25", "n3_16_55"),
    "vl53l1x": ("n1_8_0", "n1_16_0", "n2_8_25", "n2_16_55"),
    "vl53l5cx": ("n1_8_0", "n2_8_25", "n2_16_25"),
}
"""The paper's layouts on a UR10, by the model of their sensors; None: the paper's sensor."""
SEARCHED = (
    ("ur10", "vl53l1x", 24),
    ("ur10", "vl53l5cx", 16),
    ("ur5e", "vl53l1x", 24),
    ("panda", "vl53l8cx", 12),
)
"""Robot, model and number of sensors of searched layouts."""
SECONDS = 10.0
"""Processor time of each search, s."""
RANDOM = 18
"""Number of random layouts."""
OTHERS = ("woomessi_strip",)
"""Layouts of others with beams that are cones or pyramids, among those that the package brings."""
_ROBOTS = ("ur10", "ur5e", "panda")
_MODELS = ("vl53l1x", "vl53l5cx", None, "vl53l8cx", "vl53l4cd", "tmf8820", "vl53l7cx")
_COUNTS = (12, 16, 24)
_GREY, _WHITE = 0.17, 0.88  # the makers' grey and white targets
ASKED = {
    "hand": _GREY,
    "arm": PIECES["arm"].reflectance,
    "torso": _GREY,
    "rod-40": _WHITE,
    "leg": _GREY,
}
"""Test pieces and their reflectances in the questions that every layout answers."""
WALKER = "person"
"""Test piece that stands for a walking person, in clothes as dark as the grey target."""
_SOON = 0.2  # s


@dataclass(frozen=True)
class Layout:
    """A layout and its scene."""

    name: str
    """Name."""
    kind: str
    """named, searched, random or other."""
    scene: Mapping[str, Any]
    """Keys of its scene."""
    setup: str | Rings | Sensors
    """Its rings and single sensors."""


@dataclass(frozen=True)
class Prediction:
    """A prediction, and what the twin saw."""

    layout: str
    """Name of the layout."""
    kind: str
    """named, searched, random or other."""
    question: Mapping[str, Any]
    """The question: piece, reflectance, seconds, at_least, ambient, and occlusion and target."""
    asked: str
    """all: every layout answers it; drawn: this one only; walk: a person on walks."""
    zeta_percent: float
    """ζ of V_S(0.5)."""
    predicted_percent: float
    """Predicted share of places or moments."""
    trials: int
    """Number of places or moments."""
    noticed: int
    """Number of those noticed."""
    law_error: float
    """Stated error of the law: it should hold 95 % of the predictions, in points."""
    means: Mapping[str, float]
    """Means of the twin's own probabilities in percent, by the best zone and any; none for
    walks."""
    spheres: SphereTrials
    """The largest unseen sphere of V_S(0.5)."""
    bins: tuple[tuple[float, ...], ...] = ()
    """Places by the law's probability there: numbers, summed probabilities, and those noticed."""

    @property
    def frequency(self) -> float:
        """The measured share, in percent."""
        return 100 * self.noticed / self.trials

    def interval(self, law_error: float = 0.0) -> tuple[float, float]:
        """Return the 95 % interval of the measured share, in percent: Clopper and Pearson's, with
        an error of the law, in points, as an independent one."""
        of = stats.binomtest(self.noticed, self.trials).proportion_ci(0.95, "exact")
        f = self.frequency
        low, high = (np.hypot(f - 100 * end, law_error) for end in (of.low, of.high))
        return f - float(low), f + float(high)

    def holds(self, law_error: float = 0.0) -> bool:
        """Return whether that interval holds the prediction."""
        low, high = self.interval(law_error)
        return low - 1e-9 <= self.predicted_percent <= high + 1e-9


def scene_keys(robot: str, model: str | None) -> dict[str, Any]:
    """Return the keys of a scene with real mounts and self-occlusion."""
    sensor = {} if model is None else {"sensor": {"model": model}}
    real = {"occlusion": "shadow", "rules": {"mount": "real"}, "electronics": {"bus": "own"}}
    return {"robot": robot, "targets": [goal_keys(SHELL)], **real, **sensor}


def layouts(run: Measure, seed: int) -> list[Layout]:
    """Return all layouts: the paper's, searched, random, and those of others."""
    found = [
        Layout(f"{name} {model or 'paper'}", "named", scene_keys("ur10", model), name)
        for model, names in NAMED.items()
        for name in names
    ]
    asked = [(scene_keys(robot, model), n) for robot, model, n in SEARCHED]
    limit = {"seed": seed, "seconds": SECONDS}
    cells = [Cell("place in time", {"scene": s, "sensors": n, **limit}) for s, n in asked]
    for i, (cell, one) in enumerate(zip(cells, run("searching layouts", cells), strict=True)):
        found.append(Layout(f"searched {i}", "searched", cell.arguments["scene"], one["rings"]))
    cells = []
    for i in range(RANDOM):
        scene = scene_keys(_ROBOTS[i % len(_ROBOTS)], _MODELS[i % len(_MODELS)])
        sensors = _COUNTS[i // 2 % len(_COUNTS)]
        cells.append(Cell("random rings", {"scene": scene, "seed": seed + i, "sensors": sensors}))
    for i, (cell, rings) in enumerate(zip(cells, run("drawing layouts", cells), strict=True)):
        found.append(Layout(f"random {i}", "random", cell.arguments["scene"], rings))
    for name in OTHERS:
        other = read_layout(PUBLISHED / f"{name}.csv")
        keys = keys_of(other.scene) | {"targets": [goal_keys(SHELL)]}
        found.append(Layout(name, "other", keys, setup_keys(other.setup, other.scene)))
    return found


def _question(piece: str, reflectance: float, **more: Any) -> dict[str, Any]:
    usual = {"seconds": _SOON, "at_least": 1, "ambient": None}
    return {"piece": piece, "reflectance": reflectance} | usual | more


def _drawn(layout: Layout, rng: np.random.Generator) -> tuple[dict[str, Any], str, Target]:
    """Return a drawn question, model of occlusion and target."""
    model = layout.scene.get("sensor", {}).get("model")
    lights = [None] if model is None else list(MODELS[model].levels)
    question = _question(
        str(rng.choice(["hand", "arm", "torso", "rod-40", "rod-70", "leg", "person"])),
        float(rng.choice([PIECES["arm"].reflectance, _GREY, _WHITE])),
        seconds=float(rng.choice([0.1, 0.2, 0.5])),
        at_least=int(rng.integers(1, 3)),
        ambient=lights[rng.integers(len(lights))],
    )
    occlusion = str(rng.choice(["ignore", "shadow", "blind"]))
    return question, occlusion, (SHELL, NEAR)[rng.integers(2)]


def measure(run: Measure, seed: int = 0) -> list[Prediction]:
    """Return all predictions, with what the twin saw.

    Args:
        run: measures cells under a heading.
        seed: random seed of searches, layouts, questions, places and noise.
    """
    each, rng = layouts(run, seed), np.random.default_rng(seed)
    shares = run(
        "counting coverage",
        [zeta_cell(a.scene, a.setup, SHELL, "sampled", tasks.VOXEL) for a in each],
    )
    zetas = {layout.name: one["zeta_percent"] for layout, one in zip(each, shares, strict=True)}
    unseen = _spheres(run, each, seed)
    asked: list[tuple[Layout, str, dict[str, Any], str, Target]] = []
    for layout in each:
        asked += [
            (layout, "all", _question(*piece), "shadow", SHELL) for piece in ASKED.items()
        ] + [(layout, "drawn", *_drawn(layout, rng)) for _ in range(DRAWN)]
    cells = []
    for i, (layout, _, question, occlusion, target) in enumerate(asked):
        name, radius = target.key
        scene = {**layout.scene, "occlusion": occlusion}
        where = {"scene": scene, "setup": layout.setup, "target": name, "radius": radius}
        cells.append(Cell("twin trials", {**where, **question, "places": PLACES, "seed": seed + i}))
    rows = []
    for (layout, how, question, occlusion, target), one in zip(
        asked, run("trying test pieces", cells), strict=True
    ):
        rows.append(
            Prediction(
                layout.name,
                layout.kind,
                question | {"occlusion": occlusion, "target": str(target)},
                how,
                zetas[layout.name],
                one["predicted_percent"],
                one["places"],
                one["noticed"],
                100 * LAW_ERROR[one["several_zones"]],
                {k: one[f"{k}_percent"] for k in ("best", "any")},
                unseen[layout.name],
                tuple(map(tuple, one["bins"])),
            )
        )
    return rows + _walks(run, each, zetas, unseen, seed)


def _spheres(run: Measure, each: list[Layout], seed: int) -> dict[str, SphereTrials]:
    """Return the largest unseen sphere of each layout, with what the twin reports of spheres."""
    name, radius = SHELL.key
    asked = {"target": name, "radius": radius, "places": SPHERES, "seed": seed}
    scenes = [{**layout.scene, "occlusion": "shadow"} for layout in each]
    cells = [
        Cell("twin spheres", {"scene": scene, "setup": layout.setup, **asked})
        for layout, scene in zip(each, scenes, strict=True)
    ]
    found = run("placing spheres", cells)
    return {layout.name: SphereTrials(**one) for layout, one in zip(each, found, strict=True)}


def _walks(
    run: Measure,
    each: list[Layout],
    zetas: Mapping[str, float],
    unseen: Mapping[str, SphereTrials],
    seed: int,
) -> list[Prediction]:
    question = _question(WALKER, _GREY)
    asked = question | {"walks": WALKS, "seed": seed}
    cells = [Cell("twin walk", {"scene": a.scene, "setup": a.setup, **asked}) for a in each]
    return [
        Prediction(
            layout.name,
            layout.kind,
            question | {"occlusion": "shadow", "target": "walks"},
            "walk",
            zetas[layout.name],
            one["predicted_percent"],
            one["moments"],
            one["noticed"],
            100 * LAW_ERROR[one["several_zones"]],
            {},
            unseen[layout.name],
        )
        for layout, one in zip(each, run("watching people walk", cells), strict=True)
    ]
