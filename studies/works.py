"""The measurements that studies are made of: functions of what JSON can hold, returning what JSON can hold."""

import json
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

from ..coverage.rings import Setup, named_setup
from ..coverage.targets import Target
from ..objectives.exact import Rule, Verifier
from ..objectives.scene import Scene
from ..placement.convert import ring_models, scene_of, setup_of
from ..placement.models import RingModel, SceneFile
from ..placement.search import Outcome
from ..placement.search import search as searching
from ..placement.variables import ring_layout
from .store import Cell

Rings = list[dict[str, Any]]


def scene_from(scene: Mapping[str, Any]) -> Scene:
    """A scene from the keys in which it differs from the reference scene, as a scene's file has them."""
    return scene_of(SceneFile.model_validate(dict(scene)))


def setup_from(setup: str | Rings, scene: Scene) -> Setup:
    """A setup from the paper's name or from rings as a proposal's file has them."""
    if isinstance(setup, str):
        return named_setup(setup, scene.sensor, scene.ring_radius)
    return setup_of([RingModel.model_validate(ring) for ring in setup], scene.sensor, scene.ring_radius)


@lru_cache(maxsize=2)
def _verifier(scene: str, rule: Rule, voxel: float | None, width: float) -> Verifier:
    """The last ones are kept, with the voxels of their targets: cells side by side share them."""
    return Verifier(scene_from(json.loads(scene)), voxel, rule, width)


def zeta(
    scene: Mapping[str, Any],
    setup: str | Rings,
    target: str,
    radius: float | None,
    rule: Rule,
    voxel: float | None,
    width: float = 0.0,
) -> dict[str, Any]:
    """Exact zeta of a setup for one target, in percent with its bounds, the voxels counted, and the seconds it took.

    Raises:
        KeyboardInterrupt: also where Ctrl-C left an interval wider than was asked for: a study must not keep that.
    """
    verifier = _verifier(json.dumps(scene, sort_keys=True), rule, voxel, width)
    found = verifier.verify(setup_from(setup, verifier.scene), Target(target, radius))
    if any(pose.proof is not None and width > 0 and not pose.proof.reached for pose in found.poses):
        raise KeyboardInterrupt
    percents = {f"{key}_percent": 100 * getattr(found, key) for key in ("zeta", "low", "high")}
    return percents | {"target": found.target_voxels, "covered": found.covered_voxels, "seconds": found.seconds}


def place(scene: Mapping[str, Any], rings_per_link: int, sensors_per_ring: int, seed: int) -> Rings:
    """The rings of a searched setup, as a proposal lists them.

    Raises:
        KeyboardInterrupt: also where Ctrl-C left the best so far: a study must not keep that.
    """
    asked = scene_from(scene)
    found = searching(asked, ring_layout(asked, rings_per_link, sensors_per_ring), seed)
    if found.outcome is Outcome.INTERRUPTED:
        raise KeyboardInterrupt
    return [ring.model_dump(exclude_none=True) for ring in ring_models(found.setup, asked.sensor)]


def shared(cell: Cell) -> str:
    """What cells with costly preparation in common have in common: everything but the setup."""
    return Cell(cell.work, {key: value for key, value in cell.arguments.items() if key != "setup"}).key


WORKS: dict[str, Callable[..., Any]] = {"zeta": zeta, "place": place}
