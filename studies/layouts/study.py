"""Published layouts of sensors, scored under the same rules, beside what the search proposes.

Each layout is counted on its own robot in its own pose, for the same target volumes, with and
without self-occlusion. The search places as many sensors of the same kind in rings on the same
robot, under self-occlusion, and maximises the mean of these targets. A search may use a limited
processor time, so that its result depends on the machine; a row states whether it completed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...coverage.definitions.errors import UserError
from ...coverage.targets.named import ReachAndToolSpheres, Shell
from ...formats.layouts.layout import SUFFIXES, PublishedLayout, read_layout
from ...placement.space.design import Space
from ...placement.space.feasible_set import InfeasibleError
from ..engine.scenes import goal_keys, keys_of, setup_keys
from ..engine.store import Cell, Measure
from ..engine.tasks import zeta_cell

TARGETS = (Shell(0.25), Shell(0.5), Shell(1.5), ReachAndToolSpheres())
VOXEL = 0.01  # m
WIDTH = 0.005  # width of the guaranteed intervals, as a share
SECONDS = 40.0  # processor time of each search
PUBLISHED = Path(__file__).parent / "published"
"""Folder of the layouts that the package brings."""


@dataclass(frozen=True)
class Score:
    """Coverage of a setup: percentages by the labels of the targets."""

    ignore: Mapping[str, float]
    """ζ with beams that pass through the robot."""
    shadow: Mapping[str, float]
    """ζ with self-occlusion."""
    low: Mapping[str, float]
    """Lower end of the guaranteed interval of ``shadow``."""
    high: Mapping[str, float]
    """Upper end of that interval."""


@dataclass(frozen=True)
class ScoredLayout:
    """A layout with its score, and the search with as many sensors."""

    layout: PublishedLayout
    """The layout."""
    scene: Mapping[str, Any]
    """Keys of its scene, with self-occlusion."""
    setup: Mapping[str, Any]
    """Its rings and single sensors, as in a proposal."""
    score: Score
    """Coverage of the layout."""
    unseeing: int
    """Sensors that are almost fully blocked by the robot."""
    proposal: Mapping[str, Any]
    """The rings that the search proposes, as in a proposal."""
    proposed: Score
    """Coverage of the proposal."""
    finished: bool
    """Whether the search completed within its processor time."""
    processor_seconds: float
    """Processor time of the search, s."""
    wall_seconds: float
    """Duration of the search, s."""
    limit_seconds: float
    """Processor time that the search was allowed, s."""

    @property
    def sensors(self) -> int:
        """Number of sensors."""
        return self.layout.setup.sensors


def layouts(own: Sequence[Path] = ()) -> list[PublishedLayout]:
    """Return the layouts that the package brings, then those of ``own`` files.

    Raises:
        UserError: if a file is not usable, or two layouts have the same name.
    """
    files = sorted(file for file in PUBLISHED.iterdir() if file.suffix in SUFFIXES)
    found: dict[str, PublishedLayout] = {}
    for file in (*files, *own):
        layout = read_layout(file)
        if layout.name in found:
            raise UserError(
                f"{file}: found a second layout called {layout.name}; give the file another name"
            )
        found[layout.name] = layout
    for layout in found.values():
        if layout.path in own:
            _check_search(layout)
    return list(found.values())


def _check_search(layout: PublishedLayout) -> None:
    """Raise ``UserError`` if no rings on the robot hold as many sensors."""
    try:
        Space(layout.scene, sensors=layout.setup.sensors)
    except InfeasibleError as error:
        raise UserError(
            f"{layout.path}: the search beside it cannot place as many sensors"
            f" ({layout.setup.sensors}) in rings on {layout.scene.robot.name}: {error}"
        ) from error


def scene_keys(layout: PublishedLayout, occlusion: str) -> dict[str, Any]:
    """Return the keys of a layout's scene under a model of occlusion, with all targets."""
    return keys_of(layout.scene) | {
        "occlusion": occlusion,
        "targets": [goal_keys(target) for target in TARGETS],
    }


def measure(
    run: Measure, some: Sequence[PublishedLayout], seed: int = 0, seconds: float = SECONDS
) -> list[ScoredLayout]:
    """Return all layouts with their scores.

    Args:
        run: measures cells under a heading.
        some: the layouts.
        seed: random seed of the searches.
        seconds: processor time of each search, s.
    """
    scenes = [scene_keys(layout, "shadow") for layout in some]
    setups = [setup_keys(layout.setup, layout.scene) for layout in some]
    scores = _scores(run, "scoring layouts", some, setups)
    unseeing = run(
        "counting blocked sensors",
        [
            Cell("unseeing sensors", {"scene": scene, "setup": setup})
            for scene, setup in zip(scenes, setups, strict=True)
        ],
    )
    searches = [
        Cell(
            "place in time",
            {
                "scene": scene,
                "seed": seed,
                "sensors": layout.setup.sensors,
                "seconds": seconds,
            },
        )
        for layout, scene in zip(some, scenes, strict=True)
    ]
    found = run("searching as many sensors", searches)
    proposals = [{"rings": one["rings"], "sensors": []} for one in found]
    proposed = _scores(run, "scoring proposals", some, proposals)
    return [
        ScoredLayout(
            layout,
            scene,
            setup,
            score,
            blocked,
            proposal,
            other,
            search["finished"],
            search["processor_seconds"],
            search["wall_seconds"],
            seconds,
        )
        for layout, scene, setup, score, blocked, proposal, other, search in zip(
            some, scenes, setups, scores, unseeing, proposals, proposed, found, strict=True
        )
    ]


def _scores(
    run: Measure, heading: str, some: Sequence[PublishedLayout], setups: Sequence[Mapping[str, Any]]
) -> list[Score]:
    """Return the coverage of setups in the layouts' scenes."""
    ways: dict[str, tuple[str, dict[str, Any]]] = {
        "ignore": ("ignore", {"voxel": VOXEL}),
        "shadow": ("shadow", {"voxel": VOXEL}),
        "certified": ("shadow", {"rule": "certified", "voxel": None, "width": WIDTH}),
    }
    cells = [
        zeta_cell(scene_keys(layout, occlusion), setup, target, **how)
        for layout, setup in zip(some, setups, strict=True)
        for occlusion, how in ways.values()
        for target in TARGETS
    ]
    results = iter(run(heading, cells))
    scores = []
    for _ in some:
        by_way = {way: {str(target): next(results) for target in TARGETS} for way in ways}

        def part(way: str, end: str, of: dict[str, dict[str, Any]] = by_way) -> dict[str, float]:
            return {name: round(one[f"{end}_percent"], 4) for name, one in of[way].items()}

        counted = part("ignore", "zeta"), part("shadow", "zeta")
        scores.append(Score(*counted, part("certified", "low"), part("certified", "high")))
    return scores
