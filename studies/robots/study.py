"""Cost of ignoring the robot's body: searches under each model of occlusion, counted under all
three.

Each robot is in its default pose. A search may use as much processor time as two processors have in
a minute, also on a busy machine. Its speed therefore affects the answer, and a row states whether
the search completed.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...coverage.occlusion.occlusion_mode import ONE_TARGET
from ...coverage.targets.named import Shell
from ..engine.scenes import Rings, goal_keys, ring_keys, scene_from, setup_from
from ..engine.store import Cell, Measure
from ..engine.tasks import zeta_cell

ROBOTS = ("ur3e", "ur5e", "ur10", "ur10e", "panda", "iiwa14")
TARGET = Shell(0.5)
SENSORS = 40  # 80 in real rings have no room on a Panda and on an iiwa
VOXEL = 0.01  # m
SECONDS, PROCESSORS = 60.0, 2  # processor time of each search
PAPERS = ("n1_8_0", "n1_16_0", "n2_16_25", "n2_16_55", "n3_16_55")
_REAL: dict[str, Any] = {"rules": {"mount": "real"}}
# Names of searches, and the keys of their scenes: rings have bodies on real mounts, but not in the
# paper.
SEARCHES: dict[str, dict[str, Any]] = {
    "ignore": {"occlusion": "ignore"},
    "ignore_mounted": {"occlusion": "ignore"} | _REAL,
    "shadow": {"occlusion": "shadow"} | _REAL,
    "blind": {"occlusion": "blind"} | _REAL,
}


@dataclass(frozen=True)
class RobotRow:
    """A setup on a robot."""

    robot: str
    """Name of the robot."""
    name: str
    """Name of the paper's layout, or of the search."""
    rings: Rings
    """Rings as in a proposal."""
    ignore: float
    """ζ in percent under ``ignore``."""
    shadow: float
    """ζ in percent under ``shadow``."""
    blind: float
    """ζ in percent under ``blind``."""
    unseeing: int
    """Number of sensors that are almost fully blocked by the body."""
    processor_seconds: float | None = None
    """Processor time of the search, or None."""
    wall_seconds: float | None = None
    """Wall time of the search, or None."""
    finished: bool | None = None
    """True if the search completed, or None."""

    @property
    def sensors(self) -> int:
        return sum(ring["count"] for ring in self.rings)

    @property
    def searched(self) -> bool:
        return self.finished is not None


def where(robot: str, keys: Mapping[str, object]) -> dict[str, Any]:
    """Return the keys of the scene of a robot in its default pose."""
    return {"robot": robot, "targets": [goal_keys(TARGET)], **keys}


def pose_deg(robot: str) -> list[float]:
    """Return the robot's default pose in degrees."""
    return [round(float(a), 3) + 0.0 for a in np.degrees(scene_from(where(robot, {})).poses[0].q)]


def measure(run: Measure, seed: int = 0) -> list[RobotRow]:
    """Return all rows.

    Args:
        run: measures cells under a heading.
        seed: random seed of the searches.
    """
    asked = {"seed": seed, "sensors": SENSORS, "seconds": PROCESSORS * SECONDS}
    wanted = [(robot, name) for robot in ROBOTS for name in SEARCHES]
    searches = [
        Cell("place in time", {"scene": where(robot, SEARCHES[name]), **asked})
        for robot, name in wanted
    ]
    found = dict(zip(wanted, run("searching setups", searches), strict=True))
    setups = {key: one["rings"] for key, one in found.items()} | {
        (r, name): named_rings(r, name) for r in ROBOTS for name in PAPERS
    }
    cells = {
        (*key, model): zeta_cell(_seen(*key, model), rings, TARGET, voxel=VOXEL)
        for model in ONE_TARGET
        for key, rings in setups.items()
    }
    zetas = dict(zip(cells, run("counting voxels", list(cells.values())), strict=True))
    sight = [
        Cell("unseeing sensors", {"scene": _seen(robot, name, "shadow"), "setup": rings})
        for (robot, name), rings in setups.items()
    ]
    unseeing = dict(zip(setups, run("counting blocked sensors", sight), strict=True))
    rows = []
    for robot in ROBOTS:
        for name in (*SEARCHES, *PAPERS):
            ignore, shadow, blind = (
                round(zetas[robot, name, model]["zeta_percent"], 4) for model in ONE_TARGET
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


def _seen(robot: str, name: str, model: str) -> dict[str, Any]:
    """Return the keys of the scene in which a setup is counted under a model of occlusion; its
    rings are as in its search, or the paper's."""
    return where(robot, SEARCHES.get(name, {}) | {"occlusion": model})


def named_rings(robot: str, name: str) -> Rings:
    """Return the rings of the paper's setup of that name on a robot."""
    scene = scene_from(where(robot, {}))
    return ring_keys(setup_from(name, scene), scene.sensor)
