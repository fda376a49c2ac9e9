"""What ignoring the robot's body costs, robot by robot: searches under each model of occlusion,
seen under all three.

Each robot stands in its own pose. A search has what two processors do in a minute, also on a
machine that others use; its speed then has a part in the answer, and a row says whether its search
came to its end.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...coverage.occlusion.model import OCCLUSIONS
from ...coverage.targets import Target
from ...formats.schema.ring_models import ring_models
from ..engine.scenes import Rings, scene_from, setup_from
from ..engine.store import Cell

ROBOTS = ("ur3e", "ur5e", "ur10", "ur10e", "panda", "iiwa14")
TARGET = Target("V_S", 0.5)
SENSORS = 80
VOXEL = 0.01  # m
SECONDS, PROCESSORS = 60.0, 2  # that each search has to itself
PAPERS = ("n1_8_0", "n1_16_0", "n2_16_25", "n2_16_55", "n3_16_55")
# Names of searches, and the keys of their scenes: the paper's rings have no bodies, those of a real
# mount do.
SEARCHES: dict[str, dict[str, Any]] = {
    "ignore": {"occlusion": "ignore"},
    "ignore_mounted": {"occlusion": "ignore", "rules": {"mount": "real"}},
    "shadow": {"occlusion": "shadow"},
    "blind": {"occlusion": "blind"},
}

Measure = Callable[[str, list[Cell]], list[Any]]


@dataclass(frozen=True)
class RobotRow:
    """A setup on a robot: its name (the paper's, or that of a search), its rings, zeta in percent
    under each model, its sensors that see nothing past the body; and of a search its seconds of
    processors, all together, and on the wall, and whether these were enough."""

    robot: str
    name: str
    rings: Rings
    ignore: float
    shadow: float
    blind: float
    unseeing: int
    processor_seconds: float | None = None
    wall_seconds: float | None = None
    finished: bool | None = None

    @property
    def sensors(self) -> int:
        return sum(ring["count"] for ring in self.rings)

    @property
    def searched(self) -> bool:
        return self.finished is not None


def where(robot: str, keys: Mapping[str, object]) -> dict[str, Any]:
    """Keys of the scene of a robot in its own pose."""
    return {"robot": robot, "targets": [{"name": TARGET.name, "radius": TARGET.radius}], **keys}


def pose_deg(robot: str) -> list[float]:
    """The robot's own pose, in degrees."""
    return [round(float(a), 3) + 0.0 for a in np.degrees(scene_from(where(robot, {})).poses[0].q)]


def measure(run: Measure, seed: int = 0) -> list[RobotRow]:
    """All rows, where ``run`` measures cells under a heading; ``seed``: of the searches."""
    asked = {"seed": seed, "sensors": SENSORS, "seconds": PROCESSORS * SECONDS}
    wanted = [(robot, name) for robot in ROBOTS for name in SEARCHES]
    searches = [
        Cell("place in time", {"scene": where(robot, SEARCHES[name]), **asked})
        for robot, name in wanted
    ]
    found = dict(zip(wanted, run("searching setups", searches), strict=True))
    setups = {key: one["rings"] for key, one in found.items()} | {
        (r, name): _named(r, name) for r in ROBOTS for name in PAPERS
    }
    count = {"target": TARGET.name, "radius": TARGET.radius, "rule": "centre", "voxel": VOXEL}
    cells = {
        (*key, model): Cell(
            "zeta", {"scene": where(key[0], {"occlusion": model}), "setup": rings, **count}
        )
        for model in OCCLUSIONS
        for key, rings in setups.items()
    }
    zetas = dict(zip(cells, run("counting voxels", list(cells.values())), strict=True))
    sight = [
        Cell("unseeing sensors", {"scene": where(robot, {"occlusion": "shadow"}), "setup": rings})
        for (robot, _), rings in setups.items()
    ]
    unseeing = dict(zip(setups, run("looking for sensors that see nothing", sight), strict=True))
    rows = []
    for robot in ROBOTS:
        for name in (*SEARCHES, *PAPERS):
            ignore, shadow, blind = (
                round(zetas[robot, name, model]["zeta_percent"], 4) for model in OCCLUSIONS
            )
            rings, none = setups[robot, name], unseeing[robot, name]
            row = RobotRow(robot, name, rings, ignore, shadow, blind, none)
            if one := found.get((robot, name)):
                row = replace(
                    row,
                    **{key: one[key] for key in ("processor_seconds", "wall_seconds", "finished")},
                )
            rows.append(row)
    return rows


def _named(robot: str, name: str) -> Rings:
    """The rings of the paper's setup of that name on a robot."""
    scene = scene_from(where(robot, {}))
    return [
        ring.model_dump(exclude_none=True)
        for ring in ring_models(setup_from(name, scene), scene.sensor)
    ]
