"""Tasks that count: exact ζ of a setup, and its sensors that are almost fully blocked."""

import json
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from ...coverage.choices import Rule
from ...objectives.occlusion import unseeing
from ...objectives.verify import Verifier
from .registry import register
from .scenes import Rings, Sensors, scene_from, setup_from


@lru_cache(maxsize=2)
def _verifier(scene: str, rule: Rule, voxel: float | None, width: float) -> Verifier:
    """Return a verifier; the latest ones are cached with their voxels for neighbouring cells."""
    return Verifier(scene_from(json.loads(scene)), voxel, rule, width)


@register("zeta")
def zeta(
    scene: Mapping[str, Any],
    setup: str | Rings | Sensors,
    target: str,
    radius: float | None,
    rule: Rule,
    voxel: float | None,
    width: float = 0.0,
) -> dict[str, Any]:
    """Count ζ of a setup for one target.

    Returns:
        ζ in percent with its bounds, the number of voxels, and the time in seconds.

    Raises:
        KeyboardInterrupt: also if Ctrl-C left an interval wider than ``width``, which a study must
            not store.
    """
    verifier = _verifier(json.dumps(scene, sort_keys=True), rule, voxel, width)
    wanted = verifier.scene.target_named(target, radius)
    found = verifier.verify(setup_from(setup, verifier.scene), wanted)
    if any(pose.proof is not None and width > 0 and not pose.proof.reached for pose in found.poses):
        raise KeyboardInterrupt
    percents = {f"{key}_percent": 100 * getattr(found, key) for key in ("zeta", "low", "high")}
    return percents | {
        "target": found.target_voxels,
        "covered": found.covered_voxels,
        "seconds": found.seconds,
    }


@register("unseeing sensors")
def unseeing_sensors(scene: Mapping[str, Any], setup: str | Rings | Sensors) -> int:
    """Return how many sensors are almost fully blocked at some pose, under the scene's
    occlusion.
    """
    where = scene_from(scene)
    return len({(u.ring, u.sensor) for u in unseeing(where, setup_from(setup, where))})
